# SPDX-License-Identifier: Apache-2.0
"""The detector: motion of a scene in, contacts out."""

from __future__ import annotations

import contextlib
import inspect
import re
import threading
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Literal, NoReturn, cast, overload

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments, detail_options, device_arrays
from .array_types import ArrayLike, Detail, MeshName, Positions, Stream
from .contacts import Contacts
from .detail_core import DetailedCore
from .device_distances import DeviceDistances
from .device_results import DeviceContacts, DeviceIntersections, DeviceProximity
from .devices import backends, gpu_status
from .mesh_layout import Indices
from .motion_queries import MotionQueries
from .options import (
    ACCURACIES,
    ALL_OUTPUTS,
    BACKENDS,
    METHODS,
    REFINE,
    REPORTS,
    RESULTS,
    SIMD,
    Accuracy,
    Backend,
    Feature,
    Method,
    Output,
    Refine,
    Report,
    Results,
    Simd,
)
from .proximity import Gap, Intersections, Proximity
from .result_types import DistancesResult, IntersectionsResult, MotionResult, Options, ProximityResult, StepResult
from .scene import Scene
from .snapshot_queries import SnapshotQueries
from .solid_queries import SolidQueries

if TYPE_CHECKING:
    from typing_extensions import Unpack  # typing has it from Python 3.11 on


@contextlib.contextmanager
def _names_of_a_step() -> Iterator[None]:
    """Errors of the core name both ends of a motion; step() takes one."""
    try:
        yield
    except _core.InvalidArgument as error:
        text = re.sub("vertices_t0, vertices_t1|vertices_t[01]", "vertices", str(error), count=1)
        raise _core.InvalidArgument(text) from None


def _require_device(backend: str, method: str, on_host: bool) -> None:
    """Raises ValueError where results cannot stay on a device."""
    if "gpu" not in backends():
        why = gpu_status()["reason"] or "the GPU backend is not part of this build"
        raise ValueError(f"results: 'device' needs a usable GPU, and there is none here ({why}); use results='host'")
    if backend not in ("auto", "gpu"):
        raise ValueError(f"results: 'device' is not offered by backend {backend!r}; use backend='gpu' or 'auto'")
    if method != "default":
        raise ValueError(f"results: 'device' is not offered by method {method!r}, which runs on CPUs; use 'default'")
    if on_host:
        raise ValueError("results: 'device' is not offered for planes or points, which the host tests; use 'host'")


class Detector(
    MotionQueries[MotionResult, StepResult],
    SnapshotQueries[ProximityResult, IntersectionsResult, DistancesResult],
    SolidQueries,
):
    """Finds every contact of a scene whose vertices move on straight lines from one set of positions to the next.

    The scene is copied: meshes and rules that change later do not reach this detector.

    Parameters
    ----------
    scene : Scene
        Meshes, and which pairs of them are tested.
    accuracy : {"exact", "conservative", "balanced", "fast"}
        "exact": decided as by rational arithmetic. "conservative": no false negatives. "balanced", "fast": rounded.
    backend : {"auto", "cpu", "gpu", "hybrid"}
        Where to compute. "auto" picks the fastest for this scene and machine.
    threads : int
        Number of CPU threads; 0 for all cores.
    report : {"all", "first", "any"}
        All contacts, those at the earliest time of impact, or any one, not necessarily the earliest.
    outputs : iterable of {"points", "normals", "closest", "weights", "directions"}
        What to compute beside features and times of impact: "weights" gives `vertices`, `weights` and `approach`, and
        "points" the curves of :class:`Intersections`, which "directions" shorten.
    minimum_separation : float
        Report features that come within this distance, in the unit of the coordinates; 0 reports only contact. Keep
        it below the distance of neighbours within each mesh (distances() at rest), or these are always reported.
    features : {"vertex_face", "edge_edge"} or both
        Which pairs of features are tested by detect, step, collision_free_step, collision_free_motion and proximity.
    results : {"host", "device"}
        Results as numpy arrays, or left in the GPU's memory (DeviceContacts and others).
    worlds : int, optional
        Number of independent copies of the scene; positions are then (W, V, 3). None: one scene, (V, 3).
    method : {"default", "published", "naive", "front"}
        CPU broad phase: this library's; Kim et al. 2009, their baseline of section 3.2; Tang et al. 2009.
    simd : {"auto", "scalar", "avx2", "avx512", "neon"}
        CPU instruction set. Results are the same.
    restructure : bool
        Whether "published" and "naive" restructure their hierarchies.
    detail, refine : float or dict, and {"none", "neighbours"}
        Detect on coarse faces with a proven bound: 0.1 of all, by mesh, or to an error; refine: `docs/detail.md`.
    hybrid_segments, hybrid_segment_pairs, gpus : int
        Backend "hybrid": segments of the queue between CPU threads and GPUs, pairs of leaves in each, GPUs (0: all).

    Raises
    ------
    TypeError, ValueError
        If an option is unknown, invalid, or not available here.
    RuntimeError
        If the system cannot start that many threads.

    Notes
    -----
    Queries of a motion: :meth:`detect`, :meth:`step`, :meth:`collision_free_step`, :meth:`collision_free_motion`.
    Queries of one frame: :meth:`proximity`, :meth:`intersections`, :meth:`distances`, :meth:`winding_numbers`,
    :meth:`signed_distances`, :meth:`separating_translation`, :meth:`penetration`. All take positions and `stream` as
    :meth:`detect` does, and raise the same errors. Calls from several threads wait for each other; only :meth:`cancel`
    does not. A child process made by os.fork() cannot use a detector with more than one thread. Detectors cannot be
    pickled.

    Examples
    --------
    >>> import numpy as np
    >>> import hpccd_core as hc
    >>> scene = hc.Scene()
    >>> _ = scene.add_mesh("falling", [[0, 1, 2]])
    >>> _ = scene.add_mesh("ground", [[0, 1, 2]], static=True)
    >>> ground = np.array([[-5.0, -5, 0], [5, -5, 0], [0, 5, 0]])
    >>> triangle = np.array([[0.0, 0, 1], [1, 0, 3], [0, 1, 3]])
    >>> detector = hc.Detector(scene)
    >>> detector.detect({"falling": triangle, "ground": ground}, {"falling": triangle - [0, 0, 2], "ground": ground})
    Contacts(1 vertex-face, 0 edge-edge, first at 0.5)
    """

    _complete = False
    _gpu_stages = False  # for measuring, in a class derived from this one: `profile` tells device time by stage too

    @overload
    def __init__(
        self: Detector[Contacts, float, Proximity, Intersections, list[Gap]],
        scene: Scene,
        *,
        results: Literal["host"] = "host",
        worlds: None = None,
        **options: Unpack[Options],
    ) -> None: ...

    @overload
    def __init__(
        self: Detector[Contacts, NDArray[np.float64], Proximity, Intersections, list[list[Gap]]],
        scene: Scene,
        *,
        results: Literal["host"] = "host",
        worlds: int,
        **options: Unpack[Options],
    ) -> None: ...

    @overload
    def __init__(
        self: Detector[DeviceContacts, float, DeviceProximity, DeviceIntersections, DeviceDistances],
        scene: Scene,
        *,
        results: Literal["device"],
        worlds: None = None,
        **options: Unpack[Options],
    ) -> None: ...

    @overload
    def __init__(
        self: Detector[DeviceContacts, NDArray[np.float64], DeviceProximity, DeviceIntersections, DeviceDistances],
        scene: Scene,
        *,
        results: Literal["device"],
        worlds: int,
        **options: Unpack[Options],
    ) -> None: ...

    def __init__(
        self,
        scene: Scene,
        *unnamed: Any,
        accuracy: Accuracy = "exact",
        backend: Backend = "auto",
        threads: int = 0,
        report: Report = "all",
        outputs: Output | Iterable[Output] = (),
        minimum_separation: float = 0.0,
        features: Feature | Iterable[Feature] = ("vertex_face", "edge_edge"),
        results: Results = "host",
        worlds: int | None = None,
        method: Method = "default",
        simd: Simd = "auto",
        restructure: bool = True,
        hybrid_segments: int = 128,
        hybrid_segment_pairs: int = 2048,
        gpus: int = 0,
        detail: Detail | None = None,
        refine: Refine = "none",
        **unknown: Any,
    ) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(
                f"scene: expected hpccd_core.Scene, got {type(scene).__name__}; create one with Scene() and add_mesh()"
            )
        if unnamed:
            raise TypeError(
                f"Detector: options are given by name, as in accuracy='exact'; got {len(unnamed)} without a name"
            )
        for name in unknown:
            remedy = _OTHER_NAMES.get(name) or (
                f"help(hpccd_core.Detector) lists them{arguments.did_you_mean(name, _OPTIONS)}"
            )
            raise TypeError(f"Detector: there is no option {name!r}; {remedy}")
        self.accuracy = arguments.choice("accuracy", accuracy, ACCURACIES)
        self.report = arguments.choice("report", report, REPORTS)
        arguments.choice("backend", backend, BACKENDS)
        if backend != "auto" and backend not in backends():
            why = gpu_status()["reason"] or "it is not part of this build"
            usable = ", ".join(["auto", *backends()])
            raise ValueError(f"backend: {backend!r} is not usable here ({why}); use one of {usable}")
        self.results = arguments.choice("results", results, RESULTS)
        self.method = arguments.choice("method", method, METHODS)
        if results == "device":
            _require_device(backend, method, len(scene.layout.planes) > 0 or scene._has_points())
        self.refine = arguments.choice("refine", refine, REFINE)
        if detail is None and refine != "none":
            raise ValueError("refine: is for coarse meshes; give detail too, as in detail=0.1")
        self._backend = backend
        self._outputs = arguments.output_names(outputs)
        self.features = arguments.feature_names(features)
        threads = arguments.whole_number("threads", threads, 0, 1024)
        arguments.choice("simd", simd, SIMD)
        if method != "default" and report == "any":
            raise ValueError(
                f"report: 'any' is not offered by method {method!r}; use method='default', or report='all' or 'first'"
            )
        hybrid_segments = arguments.whole_number("hybrid_segments", hybrid_segments, 1, 65536)
        hybrid_segment_pairs = arguments.whole_number("hybrid_segment_pairs", hybrid_segment_pairs, 1, 1 << 20)
        gpus = arguments.whole_number("gpus", gpus, 0, 1024)
        if gpus > (here := len(gpu_status()["devices"])) and backend in ("hybrid", "auto"):
            raise ValueError(f"gpus: {gpus} requested, {here} are usable here; give at most {here}, or 0 for all")
        minimum_separation = arguments.length("minimum_separation", minimum_separation)
        self.worlds = None if worlds is None else arguments.whole_number("worlds", worlds, 1, _core.MOST_WORLDS)
        self.n_vertices = scene.n_vertices
        self._shape = (self.n_vertices, 3) if self.worlds is None else (self.worlds, self.n_vertices, 3)
        self._rows = self.n_vertices * (self.worlds or 1)
        self._layout = scene.layout
        self._posed = scene._posed_meshes()
        self._n_others = scene._vertices_without_shape()
        self._has_shapes = scene._has_shapes()
        self._n_mesh_pairs = scene._n_enabled_pairs()
        self._mesh_numbers = {name: number for number, name in enumerate(self._layout.mesh_names)}
        options = _core.Options()
        options.accuracy = getattr(_core.Accuracy, accuracy)
        options.backend = getattr(_core.Backend, backend)
        options.report = getattr(_core.Report, report)
        options.simd = getattr(_core.Simd, simd)
        options.threads = threads
        options.points = "points" in self._outputs
        options.normals = "normals" in self._outputs
        options.closest = "closest" in self._outputs
        options.weights = "weights" in self._outputs
        options.directions = "directions" in self._outputs
        options.minimum_separation = minimum_separation
        options.method = getattr(_core.Method, method)
        options.restructure = arguments.flag("restructure", restructure)
        options.hybrid_segments = hybrid_segments
        options.hybrid_segment_pairs = hybrid_segment_pairs
        options.gpus = gpus
        options.gpu_stages = self._gpu_stages
        options.features = _core.TestedFeatures("vertex_face" in self.features, "edge_edge" in self.features)
        options.results_on_device = results == "device"
        options.worlds = self.worlds or 1
        self._detailed: DetailedCore | None = None
        if detail is None:
            self._core = _core.Detector(scene._core, options)
        else:
            self._detailed = self._core = self._with_detail(scene, options, detail)
        self._stepping = threading.RLock()  # of the positions of the last step
        self._last: NDArray[Any] | None = None
        self._last_on_device = device_arrays.LastStep()
        self._complete = True

    def _with_detail(self, scene: Scene, options: _core.Options, detail: object) -> Any:
        """The core of coarse meshes. Raises ValueError for options that it does not have."""
        for name, given in (("worlds", self.worlds is not None), ("results", self.results == "device")):
            if given:
                raise ValueError(
                    f"{name}: not offered with detail; use one world and results='host', or leave detail out"
                )
        layout = self._layout
        counts = np.diff(layout.face_offsets).tolist()
        details = detail_options.of_meshes(detail, layout.mesh_names, layout.vertex_counts, counts)
        tested = "vertex_face" in self.features, "edge_edge" in self.features
        return DetailedCore(scene, options, details, self.refine == "neighbours", self.report, tested)

    def __setattr__(self, name: str, value: object) -> None:
        if name[0] != "_" and self._complete and name in _OPTIONS:
            raise AttributeError(
                f"{name}: a detector's options do not change; make another Detector (for separations: set_separation)"
            )
        object.__setattr__(self, name, value)

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "Detector: holds threads and working memory, and cannot be pickled or copied; pickle its Scene, and make a "
            "Detector from that where it is used"
        )

    @arguments.hide_unnamed
    def step(self, vertices: Positions, *unnamed: NoReturn, stream: Stream = None) -> MotionResult:
        """Contacts of the motion from the positions of the last call to these.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            They are copied. Rejected positions do not count: the next step starts where this one would have. Device
            arrays must not alternate with host arrays; call :meth:`reset` in between.
        stream : Stream, optional

        Returns
        -------
        Contacts or DeviceContacts
            The first call, and the first after :meth:`reset`, returns no contacts.
        """
        if unnamed:
            arguments.reject_unnamed("step", "one array of positions; for two call detect(vertices_t0, vertices_t1)")
        made_on = device_arrays.stream_number(stream)
        with self._stepping:
            if device_arrays.is_on_device(vertices):
                found = self._step_on_device(vertices, made_on)
            else:
                found = self._step_on_host(vertices, made_on)
            return cast(MotionResult, found)

    def _step_on_host(self, vertices: object, stream: int | None) -> Any:
        if self._last_on_device:
            raise TypeError("vertices: the last step was a device array; give another one, or call reset() first")
        # Checked, used and kept as it is now, whatever the caller writes there meanwhile.
        end = arguments.vertices("vertices", vertices, self._shape, self._layout).copy()
        if self._detailed is not None:
            self._detailed.owns(end)
        if self._last is None and self.results == "host":
            arguments.usable("vertices", end)
            contacts: Any = self._no_contacts()
        else:
            with _names_of_a_step():
                contacts = self.detect(end if self._last is None else self._last, end, stream=stream)
            if self._last is None:
                contacts = contacts.without_rows()
        self._last = end
        return contacts

    def _step_on_device(self, vertices: object, stream: int | None) -> Any:
        if self._last is not None:
            raise TypeError("vertices: the last step was a host array; give another one, or call reset() first")
        place = device_arrays.positions("vertices", vertices, self._shape, stream)
        last = self._last_on_device.place
        if last is not None and last.is_double != place.is_double:
            kind = "float64" if last.is_double else "float32"
            raise TypeError(f"vertices: the last step was {kind} on the device; give that again, or call reset() first")
        # The device checks the first one too, as a step that goes nowhere. The last one is complete: it needs no more
        # waiting than this one.
        start = place if last is None else last._replace(made_on=stream)
        with _names_of_a_step():
            contacts = self._contacts(self._of_places("detect", start, place))
        self._last_on_device.keep(place, self._rows)
        if last is not None:
            return contacts
        return self._no_contacts() if self.results == "host" else contacts.without_rows()

    def _no_contacts(self) -> Contacts:
        return Contacts.none(self.worlds, self._outputs, self._layout)

    def set_separation(self, mesh_a: MeshName, mesh_b: MeshName, separation: float) -> None:
        """From the next call on, report features of two meshes that come within a distance; nothing is rebuilt.

        Parameters
        ----------
        mesh_a, mesh_b : str or int
            Names or numbers of the meshes; the same mesh twice means its self-contact.
        separation : float
            Euclidean distance in the unit of the coordinates; 0 reports only contact.

        Notes
        -----
        Up to 256 meshes, separations are one table. Beyond that, memory and the cost of a change grow with the number
        of pairs that were set; on GPUs, if pairs differ, with the square of the number of meshes.
        """
        distance = arguments.separation(separation)
        a, b = (arguments.mesh_number(n, m, self._mesh_numbers) for n, m in (("mesh_a", mesh_a), ("mesh_b", mesh_b)))
        self._core.set_separation(a, b, distance)

    def set_separations(self, of_pairs: ArrayLike) -> None:
        """:meth:`set_separation` of all pairs at once.

        Parameters
        ----------
        of_pairs : ArrayLike, shape (K, K)
            Distances of the K meshes in the order of the scene, symmetric; the diagonal is within each mesh.
        """
        n_meshes = len(self._layout.mesh_names)
        self._core.set_separations(arguments.lengths_of_pairs("of_pairs", of_pairs, n_meshes))

    def set_thickness(self, mesh: MeshName, thickness: ArrayLike) -> None:
        """From the next call on, give a mesh another thickness; nothing is rebuilt.

        Parameters
        ----------
        mesh : str or int
            Name or number of the mesh.
        thickness : ArrayLike, scalar or shape (F,)
            As in :meth:`Scene.add_mesh`.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("cloth", [[0, 1, 2], [0, 2, 3]], thickness=0.01)
        >>> detector = hc.Detector(scene)
        >>> detector.set_thickness("cloth", [0.01, 0.03])
        """
        number = arguments.mesh_number("mesh", mesh, self._mesh_numbers)
        self._core.set_thickness(number, arguments.thickness(thickness))

    def set_plane(self, plane: MeshName, normal: ArrayLike, offset: float = 0.0) -> None:
        """From the next call on, use another half-space; nothing is rebuilt.

        Parameters
        ----------
        plane : str or int
            Its name, or its number from :meth:`Scene.add_plane`.
        normal : ArrayLike, shape (3,)
        offset : float
            Both as in :meth:`Scene.add_plane`.

        Notes
        -----
        The plane does not move during a step: give its start or its end, whichever leaves less room.
        """
        number = arguments.mesh_number("plane", plane, self._mesh_numbers)
        if number not in self._layout.planes:
            planes = ", ".join(self._layout.mesh_names[k] for k in self._layout.planes) or "none"
            name = self._layout.mesh_names[number]
            raise ValueError(f"plane: {name!r} is a mesh, not a plane; the scene's planes are {planes}")
        self._core.set_plane(number, arguments.vector("normal", normal), arguments.real("offset", offset))

    @property
    def faces(self) -> Indices:
        """(F, 3) uint32: faces of the last call by scene-wide vertices; with `detail`, the coarse ones first."""
        return self._faces if self._detailed is None else self._detailed.faces()

    def cancel(self) -> None:
        """End the use of this detector, from any thread and without waiting.

        The call in progress, those that wait for it, and all later ones raise :class:`Cancelled` within 10 ms. Work
        that was handed to a GPU runs to its end first.
        """
        self._core.cancel()

    def reset(self) -> None:
        """Forget the positions of the last :meth:`step`."""
        with self._stepping:
            self._last = None
            self._last_on_device.forget()

    @property
    def backend(self) -> str:
        """Where the last call was computed: "cpu", "gpu" or "hybrid"."""
        return self._backend if self._backend == "cpu" else self._core.last_backend

    @property
    def last_gpu_error(self) -> str:
        """Why frames meant for the GPU were computed on the CPU, or an empty string; stats["gpu_fallbacks"] counts."""
        return self._core.last_gpu_error

    @property
    def threads(self) -> int:
        """Number of threads in use."""
        return self._core.threads

    @property
    def simd(self) -> str:
        """The instruction set in use."""
        return self._core.simd

    @property
    def profile(self) -> dict[str, float]:
        """Milliseconds of each stage of the last call, with "total" and the remainder "other"."""
        return self._core.profile()

    @property
    def stats(self) -> dict[str, int]:
        """Counts of the last call; empty if it failed.

        Candidate pairs, pairs that each filter culled (`vf_rejected_kdop`, `ee_rejected_kdop`: the k-DOP filter, bounds
        along eight directions beside the axes), pairs ignored by :meth:`Scene.ignore_within` and alike (`ee_ignored`),
        contacts, bytes used. `leaf_pairs_ns` (one in 64 is timed) and `kdop_ns` are parts of the stages traverse and
        elementary, summed over threads. With worlds, counts are sums, `worlds` is their number, and `waiting` the time
        of threads without a world. `gpu_fallbacks` counts frames that the CPU computed after a failure of the GPU.
        """
        return self._core.stats()


for _part in (
    MotionQueries,
    SnapshotQueries,
    SolidQueries,
):  # Python's own errors name functions: by the class that users know
    for _name, _function in vars(_part).items():
        if inspect.isfunction(_function):
            _function.__module__, _function.__qualname__ = __name__, f"Detector.{_name}"

arguments.hide_unnamed(Detector.__init__)
_OPTIONS = tuple(inspect.signature(Detector.__init__).parameters)[2:]
# Options as papers and other libraries name them, and what to write here.
_OTHER_NAMES = {
    "tier": "write accuracy=",
    "device": "write backend='cpu' or 'gpu'; results='device' leaves results on the GPU",
    **{name: f"write outputs=({name!r},)" for name in ALL_OUTPUTS},
    **{name: f"write outputs=({output!r},)" for name, output in arguments.ALIASES.items()},
    **dict.fromkeys(("gradients", "toc_gradients"), "write outputs=('normals', 'weights')"),
    "thickness": "write minimum_separation= for all meshes, or give each its own as Scene.add_mesh(..., thickness=)",
    **dict.fromkeys(
        ("d_hat", "dhat", "xi", "margin", "min_distance"),
        "write minimum_separation= for a thickness that no step violates, and call proximity(vertices, distance) for "
        "the pairs within a distance such as d-hat",
    ),
}
