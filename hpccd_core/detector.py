# SPDX-License-Identifier: Apache-2.0
"""The detector: motion of a scene in, contacts out."""

import contextlib
import re
import threading
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Literal, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, arguments, device_arrays
from .answers import OfMotion, OfNear, OfNearest, OfPierced, OfStep, Options
from .contacts import Contacts
from .device_arrays import DeviceArrayLike
from .device_results import DeviceContacts, DeviceIntersections, DeviceProximity
from .devices import backends, gpu_status
from .motion_queries import MotionQueries
from .options import (
    ACCURACIES,
    BACKENDS,
    METHODS,
    REPORTS,
    RESULTS,
    SIMD,
    Accuracy,
    Backend,
    Feature,
    Method,
    Output,
    Report,
    Results,
    Simd,
)
from .proximity import Gap, Intersections, Proximity
from .scene import Scene
from .snapshot_queries import SnapshotQueries

if TYPE_CHECKING:
    from typing_extensions import Unpack  # typing has it from Python 3.11 on


@contextlib.contextmanager
def _names_of_a_step() -> Iterator[None]:
    """Errors of the core speak of both ends of a motion; step() is given one."""
    try:
        yield
    except _core.InvalidArgument as error:
        text = re.sub("vertices_t0, vertices_t1|vertices_t[01]", "vertices", str(error), count=1)
        raise _core.InvalidArgument(text) from None


def _require_device(backend: str, method: str) -> None:
    """Raises ValueError where results cannot stay on a device."""
    if "gpu" not in backends():
        why = gpu_status()["reason"] or "the GPU backend is not part of this build"
        raise ValueError(f"results: 'device' needs a usable GPU, and there is none here ({why}); use results='host'")
    if backend not in ("auto", "gpu"):
        raise ValueError(f"results: 'device' is not offered by backend {backend!r}; use backend='gpu' or 'auto'")
    if method != "default":
        raise ValueError(f"results: 'device' is not offered by method {method!r}, which runs on CPUs; use 'default'")


class Detector(MotionQueries[OfMotion, OfStep], SnapshotQueries[OfNear, OfPierced, OfNearest]):
    """Finds every contact of a scene's straight-line motion from one set of positions to the next.

    accuracy: "fast", "balanced", "conservative" or "exact"; backend: "auto", "cpu", "hybrid" or "gpu"; threads: 0 for
    all cores; report: "all" contacts, those at the earliest time only ("first"), or one contact ("any"); outputs: any
    of "points", "normals", "closest"; simd: "auto", "scalar", "avx2", "avx512" (x86-64) or "neon" (aarch64); the result
    is the same. On the GPU "any" gives the first contact in canonical order. "fast" is computed as "balanced" by
    "hybrid" (which "auto" leaves out then), on the GPU where other pairs of meshes have another tier or a separation,
    and where edges are shorter than a 2,000th to a 4,000th of the scene. What each tier promises: docs/accuracy.md.
    minimum_separation (in coordinate units): report every pair whose Euclidean distance is at most this at some time of
    the step, and the earliest such time; 0: those that touch. scene.set_separation and set_separation() say it for a
    pair of meshes. Neighbours that share no vertex count like all others: keep it below the shortest edge. "exact":
    as rational arithmetic would decide, times within 1e-12; "conservative": the same, no time late; "balanced", "fast":
    computed as "exact". No tier reports a pair beyond the separation.
    features: what is tested at all: "vertex_face", "edge_edge" or both (default). What is left out costs nothing; what
    is left is found as ever. scene.set_features says it for a pair of meshes. It counts for detect(), step(),
    collision_free_step() and proximity(); intersections() and distances() look at whole surfaces.
    method: how CPUs find the pairs to test. Contacts, their order and hash are the same with each, "all" or "first";
    "any" (one contact, whichever comes first) is offered by "default" only.
        "default": blocks of eight triangles, boxes compared in SIMD lanes, independent tasks.
        "published": Kim et al. 2009, sections 3.3, 4 and 6: inter-CD task units, reassigned between threads without
            locks in the main loop, on a hierarchy that is restructured lazily where it culls badly.
        "naive": their section 3.2, the baseline of Fig. 7: pairs shared among threads, reconstruction behind locks.
        "front": Tang et al. 2009, with which section 6.3 compares: the front of the traversal is kept from step to
            step. Costs memory: 8 bytes for each pair of nodes where the last traversal ended.
    hybrid_segments, hybrid_segment_pairs (backend "hybrid"): the triangle index queue of Kim et al. 2009, section 5.1:
        how many segments, and how many pairs of leaves each holds. At least four segments a thread are used.
    gpus (backend "hybrid"): how many GPUs; 0 for all. A leaf is a block of eight triangles, with the published methods
        one triangle. The communication thread comes on top of `threads`; with as many as cores it takes the last one's
        place.
    restructure: of "published" and "naive", whether they restructure; False only to measure what it brings.
    results: where answers lie. "host" (default): numpy arrays. "device": detect(), step(), proximity() and
        intersections() give DeviceContacts, DeviceProximity and DeviceIntersections, whose arrays stay in the memory of
        the GPU; collision_free_step() and distances() answer on the host as ever. Needs backend "gpu" or "auto", a
        usable GPU, and method "default". Where the GPU fails, CPUs compute and the answer is brought to the device.
    worlds: so many copies of the scene, 1 to 65,536, that know nothing of each other. Positions are (W, V, 3), and each
        world is answered, by every query, bit for bit as by a detector of its own; Contacts tells how the answers of
        all stand together. CPUs take a world a thread, the GPU takes all worlds at once, "hybrid" one after the other.
        None: one scene, (V, 3).
    The scene is copied: meshes added to it later do not reach this detector.
    Raises ValueError or TypeError for an option that will not do, RuntimeError where the system starts fewer threads. A
    child process made by os.fork() has none of its threads: calls raise RuntimeError there, unless it has one alone.
    One call at a time: of the calls that several Python threads make of one detector each waits until the one before
    has ended, and profile and stats are those of the last. Only cancel() never waits. Threads that are to work side by
    side need a detector each, of one scene if they like.
    """

    _gpu_stages = False  # for measuring, in a class derived from this one: `profile` tells device time by stage too

    @overload
    def __init__(
        self: "Detector[Contacts, float, Proximity, Intersections, list[Gap]]",
        scene: Scene,
        *,
        results: Literal["host"] = "host",
        worlds: None = None,
        **options: "Unpack[Options]",
    ) -> None: ...

    @overload
    def __init__(
        self: "Detector[Contacts, NDArray[np.float64], Proximity, Intersections, list[list[Gap]]]",
        scene: Scene,
        *,
        results: Literal["host"] = "host",
        worlds: int,
        **options: "Unpack[Options]",
    ) -> None: ...

    @overload
    def __init__(
        self: "Detector[DeviceContacts, float, DeviceProximity, DeviceIntersections, list[Gap]]",
        scene: Scene,
        *,
        results: Literal["device"],
        worlds: None = None,
        **options: "Unpack[Options]",
    ) -> None: ...

    @overload
    def __init__(
        self: "Detector[DeviceContacts, NDArray[np.float64], DeviceProximity, DeviceIntersections, list[list[Gap]]]",
        scene: Scene,
        *,
        results: Literal["device"],
        worlds: int,
        **options: "Unpack[Options]",
    ) -> None: ...

    def __init__(
        self,
        scene: Scene,
        *,
        accuracy: Accuracy = "exact",
        backend: Backend = "auto",
        threads: int = 0,
        report: Report = "all",
        outputs: Output | Iterable[Output] = (),
        simd: Simd = "auto",
        minimum_separation: float = 0.0,
        method: Method = "default",
        restructure: bool = True,
        hybrid_segments: int = 128,
        hybrid_segment_pairs: int = 2048,
        gpus: int = 0,
        features: Feature | Iterable[Feature] = ("vertex_face", "edge_edge"),
        results: Results = "host",
        worlds: int | None = None,
    ) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"scene: expected hpccd_core.Scene, got {type(scene).__name__}")
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
            _require_device(backend, method)
        self._backend = backend
        computed = arguments.output_names(outputs)
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
            raise ValueError(f"gpus: {gpus} were asked for, {here} are usable here; give at most {here}, or 0 for all")
        minimum_separation = arguments.length("minimum_separation", minimum_separation)
        self.worlds = None if worlds is None else arguments.whole_number("worlds", worlds, 1, _core.MOST_WORLDS)
        self.n_vertices = scene.n_vertices
        self._shape = (self.n_vertices, 3) if self.worlds is None else (self.worlds, self.n_vertices, 3)
        self._rows = self.n_vertices * (self.worlds or 1)
        self._mesh_names = tuple(scene.mesh_names)
        self._mesh_numbers = {name: number for number, name in enumerate(self._mesh_names)}
        options = _core.Options()
        options.accuracy = getattr(_core.Accuracy, accuracy)
        options.backend = getattr(_core.Backend, backend)
        options.report = getattr(_core.Report, report)
        options.simd = getattr(_core.Simd, simd)
        options.threads = threads
        options.points = "points" in computed
        options.normals = "normals" in computed
        options.closest = "closest" in computed
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
        self._core = _core.Detector(scene._core, options)
        self._stepping = threading.RLock()  # of the positions of the last step
        self._last: NDArray[Any] | None = None
        self._last_on_device = device_arrays.LastStep()

    def step(self, vertices: ArrayLike | DeviceArrayLike, stream: object = None) -> OfMotion:
        """Streaming: the end of the last step is the start of this one. The first call returns no contacts.

        vertices: as for detect(), and refused with the same errors, the first ones too; what was refused does not
        count: the next step starts where this one would have. Device arrays are taken as by detect(); the last one is
        kept in a copy on the device. A step from a host array to a device array, or back, raises TypeError; reset()
        first. stream: as for detect(). With results="device" the first call returns no contacts on the device.
        """
        made_on = device_arrays.stream_number(stream)
        with self._stepping:
            if device_arrays.is_on_device(vertices):
                found = self._step_on_device(vertices, made_on)
            else:
                found = self._step_on_host(vertices, made_on)
            return cast(OfMotion, found)

    def _step_on_host(self, vertices: object, stream: int | None) -> Any:
        if self._last_on_device:
            raise TypeError("vertices: the last step was a device array; give another one, or call reset() first")
        # Checked, used and kept as it is now, whatever the caller writes there meanwhile.
        end = arguments.vertices("vertices", vertices, self._shape).copy()
        if self._last is None and self.results == "host":
            arguments.usable("vertices", end)
            contacts: Any = Contacts.none(self.worlds)
        else:
            with _names_of_a_step():
                contacts = self.detect(end if self._last is None else self._last, end, stream)
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
        return Contacts.none(self.worlds) if self.results == "host" else contacts.without_rows()

    def set_separation(self, mesh_a: str | int, mesh_b: str | int, separation: float) -> None:
        """From the next call on, report pairs of these two meshes (names or numbers) that come within this distance.

        The same mesh twice: within it. 0: those that touch. A call under way ends first. The next one fits its boxes to
        the new distances as it does to any motion; before it, any number of pairs may be set.
        """
        a, b = (arguments.mesh_number(n, m, self._mesh_numbers) for n, m in (("mesh_a", mesh_a), ("mesh_b", mesh_b)))
        self._core.set_separation(a, b, arguments.length("separation", separation))

    def set_separations(self, of_pairs: ArrayLike) -> None:
        """set_separation() of all pairs at once: (K, K) numbers of K meshes in the order of the scene, symmetric; the
        diagonal is within each."""
        self._core.set_separations(arguments.lengths_of_pairs("of_pairs", of_pairs, len(self._mesh_names)))

    def cancel(self) -> None:
        """End the use of this detector, from any thread and without waiting: a call under way, those that wait for it,
        and all later ones raise hpccd_core.Cancelled (a RuntimeError), within 10 ms. What has been handed to a GPU
        comes to its end first.
        """
        self._core.cancel()

    def reset(self) -> None:
        """Forget the last positions: the next step() starts anew."""
        with self._stepping:
            self._last = None
            self._last_on_device.forget()

    @property
    def backend(self) -> str:
        """Where frames are computed; for "auto", after failures of the GPU, and after queries that only CPUs answer:
        where the last one was.
        """
        return self._backend if self._backend == "cpu" else self._core.last_backend

    @property
    def last_gpu_error(self) -> str:
        """Why frames meant for the GPU were computed on the CPU (stats["gpu_fallbacks"] counts them); or empty."""
        return self._core.last_gpu_error

    @property
    def threads(self) -> int:
        """Threads in use."""
        return self._core.threads

    @property
    def simd(self) -> str:
        """The instruction set in use."""
        return self._core.simd

    @property
    def profile(self) -> dict[str, float]:
        """Stage name -> ms of the last call, with "total" and the remainder "other"."""
        return self._core.profile()

    @property
    def stats(self) -> dict[str, int]:
        """Counts of the last call: candidate pairs, those that each filter rejected, contacts, bytes used, ... Empty
        where it failed."""
        return self._core.stats()
