# SPDX-License-Identifier: Apache-2.0
"""Times of impact and distances as differentiable functions of JAX arrays, inside ``jax.jit`` too.

The detector runs on the host, in a callback. Results have JAX's default precision: float64 if
``jax_enable_x64`` is set, otherwise float32. Without it JAX rounds float64 positions to float32, and contacts are those
of the rounded positions. Gradients are those of :meth:`Contacts.toc_gradients` and of `Proximity.weights` and
`normals`. They are zero where there is no derivative: at a time of 0, for features that only graze each other, at a
distance of 0, and for +inf. There are no second derivatives and no forward mode. ``jax.vmap`` calls the detector once
for each element; a detector with `worlds` takes one call for all.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import arguments, derivatives
from .derivatives import Linearization
from .detector import Detector

try:
    import jax
    import jax.numpy as jnp
    from jax.experimental.buffer_callback import buffer_callback
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"hpccd_core.jax: cannot import JAX ({error}); pip install jax", name=error.name
    ) from None

_AnyDetector = Detector[Any, Any, Any, Any, Any]


class Rows(NamedTuple):
    """A fixed number of rows, because JAX compiles for fixed shapes.

    Attributes
    ----------
    values : jax.Array, shape (size,)
        Times or distances, in the order of the query's rows; +inf behind the last one.
    vertices : jax.Array, shape (size, 4), int32
        Vertices of each row as in :class:`Contacts`; in world k, V k is added. -1 behind the last one.
    count : jax.Array, shape (), int32
        Number of rows that the query found. If it is larger than `size`, the rest were left out: use a larger `size`.
    """

    values: jax.Array
    vertices: jax.Array
    count: jax.Array


def times_of_impact(detector: _AnyDetector, vertices_t0: jax.Array, vertices_t1: jax.Array, *, size: int) -> Rows:
    """The time of impact of each contact.

    Parameters
    ----------
    detector : Detector
        With outputs=("normals", "weights").
    vertices_t0, vertices_t1 : jax.Array, shape (V, 3) or (W, V, 3)
    size : int
        Number of rows of the result.

    Returns
    -------
    Rows

    Raises
    ------
    TypeError, ValueError
        For other arguments. If the detector rejects a coordinate, JAX raises its own error with the detector's message.

    Examples
    --------
    >>> import jax
    >>> import jax.numpy as jnp
    >>> import hpccd_core as hc
    >>> from hpccd_core import jax as hcj
    >>> scene = hc.Scene()
    >>> _ = scene.add_mesh("falling", [[0, 1, 2]])
    >>> _ = scene.add_mesh("ground", [[0, 1, 2]], static=True)
    >>> detector = hc.Detector(scene, outputs=("normals", "weights"))
    >>> start = jnp.array([[0.0, 0, 1], [1, 0, 3], [0, 1, 3], [-5, -5, 0], [5, -5, 0], [0, 5, 0]])
    >>> end = start.at[:3, 2].add(-2)
    >>> rows = jax.jit(lambda start, end: hcj.times_of_impact(detector, start, end, size=2))(start, end)
    >>> rows.values.tolist(), rows.vertices.tolist(), int(rows.count)
    ([0.5, inf], [[0, 3, 4, 5], [-1, -1, -1, -1]], 1)
    """
    derivatives.check(detector)

    def ask(start: object, end: object) -> Linearization:
        return derivatives.times(detector, start, end)[1]

    return _evaluate(detector, ask, _size(size), vertices_t0=vertices_t0, vertices_t1=vertices_t1)


def first_time_of_impact(detector: _AnyDetector, vertices_t0: jax.Array, vertices_t1: jax.Array) -> jax.Array:
    """The earliest time of impact.

    Parameters
    ----------
    detector : Detector
        With outputs=("normals", "weights"), and not with report="any".
    vertices_t0, vertices_t1 : jax.Array, shape (V, 3) or (W, V, 3)

    Returns
    -------
    jax.Array, shape () or (W,)
        +inf, without a gradient, if there are no contacts. Of several contacts at this time, the first in order has
        the gradient.

    Raises
    ------
    TypeError, ValueError
        As :func:`times_of_impact`.
    """
    derivatives.check_earliest(detector)

    def ask(start: object, end: object) -> Linearization:
        return derivatives.first_times(detector, start, end)

    times = _evaluate(detector, ask, detector.worlds or 1, vertices_t0=vertices_t0, vertices_t1=vertices_t1).values
    return times if detector.worlds is not None else times[0]


def proximity_distances(detector: _AnyDetector, vertices: jax.Array, distance: float, *, size: int) -> Rows:
    """The distance of each pair of features that are within `distance` of each other.

    Parameters
    ----------
    detector : Detector
        With outputs=("normals", "weights").
    vertices : jax.Array, shape (V, 3) or (W, V, 3)
    distance : float
        As in :meth:`Detector.proximity`.
    size : int
        Number of rows of the result.

    Returns
    -------
    Rows

    Raises
    ------
    TypeError, ValueError
        As :func:`times_of_impact`.
    """
    derivatives.check(detector)
    _reject_traced("distance", distance)
    distance = arguments.length("distance", distance)

    def ask(positions: object) -> Linearization:
        return derivatives.proximity(detector, positions, distance)[1]

    return _evaluate(detector, ask, _size(size), vertices=vertices)


def smallest_distances(detector: _AnyDetector, vertices: jax.Array) -> jax.Array:
    """The smallest distance of each pair of meshes.

    Parameters
    ----------
    detector : Detector
    vertices : jax.Array, shape (V, 3) or (W, V, 3)

    Returns
    -------
    jax.Array, shape (P,) or (W, P)
        In the order of :meth:`Detector.distances`; 0 where meshes intersect, +inf where no pair of features exists.

    Raises
    ------
    TypeError, ValueError
        As :func:`times_of_impact`.
    """
    derivatives.check(detector, outputs=())
    shape = (detector._n_mesh_pairs,) if detector.worlds is None else (detector.worlds, detector._n_mesh_pairs)

    def ask(positions: object) -> Linearization:
        return derivatives.smallest_distances(detector, positions)[1]

    return _evaluate(detector, ask, int(np.prod(shape)), vertices=vertices).values.reshape(shape)


def _size(size: int) -> int:
    _reject_traced("size", size)
    return arguments.whole_number("size", size, 0, 2**31 - 1)


def _reject_traced(name: str, value: object) -> None:
    if isinstance(value, jax.core.Tracer):
        raise TypeError(f"{name}: expected a number, got a traced value; make it a static argument of the function")


def _evaluate(detector: _AnyDetector, ask: Callable[..., Linearization], size: int, **positions: jax.Array) -> Rows:
    for name, value in positions.items():
        if isinstance(value, Mapping):
            raise TypeError(f"{name}: expected an array, got dict; concatenate the meshes in the order added")
    arrays = {name: jnp.asarray(value) for name, value in positions.items()}
    for name, array in arrays.items():  # while JAX traces: an error in the callback would be JAX's own
        one = np.zeros((), array.dtype)
        arguments.vertices(name, np.broadcast_to(one, array.shape), detector._shape, detector._layout)
    ends_like = [jax.ShapeDtypeStruct(a.shape, a.dtype) for a in arrays.values()]
    real = jax.dtypes.canonicalize_dtype(np.float64)
    gradients_like = [jax.ShapeDtypeStruct((size, 4, 3), real) for _ in arrays]
    rows_like = Rows(
        jax.ShapeDtypeStruct((size,), real),
        jax.ShapeDtypeStruct((size, 4), np.int32),
        jax.ShapeDtypeStruct((), np.int32),
    )

    def on_host(*ends: Any) -> tuple[Rows, list[NDArray[Any]]]:
        found = ask(*map(np.asarray, ends))
        values, vertices = _padded(found.values, size, np.inf, real), _padded(found.vertices, size, -1, np.int32)
        gradients = [_padded(gradient, size, 0.0, real) for gradient in found.gradients]
        return Rows(values, vertices, np.int32(len(found.values))), gradients

    def in_place(_: Any, out: Any, *ends: Any) -> None:
        for buffer, array in zip(jax.tree.leaves(out), jax.tree.leaves(on_host(*ends)), strict=True):
            np.asarray(buffer)[...] = array

    likes = rows_like, gradients_like
    # On CPUs pure_callback copies the positions in a thread of the pool that may have no other than this callback's:
    # on one core it waited for ever.
    on_cpu = buffer_callback(in_place, likes, vmap_method="sequential")
    elsewhere = functools.partial(jax.pure_callback, on_host, likes, vmap_method="sequential")

    def query(*ends: jax.Array) -> tuple[Rows, list[jax.Array]]:
        found: tuple[Rows, list[jax.Array]] = jax.lax.platform_dependent(*ends, cpu=on_cpu, default=elsewhere)
        return found

    @jax.custom_vjp
    def rows_of(*ends: jax.Array) -> Rows:
        return query(*ends)[0]

    def forward(*ends: jax.Array) -> tuple[Rows, tuple[jax.Array, list[jax.Array]]]:
        rows, gradients = query(*ends)
        return rows, (rows.vertices, gradients)

    def backward(kept: tuple[jax.Array, list[jax.Array]], of_rows: Rows) -> tuple[jax.Array, ...]:
        vertices, gradients = kept

        def total(end: jax.ShapeDtypeStruct, gradient: jax.Array) -> jax.Array:
            # Zeros stay zeros, also where the loss is infinite because a time is.
            terms = jnp.where(gradient == 0, 0, of_rows.values[:, None, None] * gradient)
            return jnp.zeros((end.size // 3, 3), real).at[vertices].add(terms, mode="drop").reshape(end.shape)

        return tuple(total(*x).astype(x[0].dtype) for x in zip(ends_like, gradients, strict=True))

    rows_of.defvjp(forward, backward)
    rows: Rows = rows_of(*arrays.values())
    return rows


def _padded(rows: NDArray[Any], size: int, filler: float, dtype: Any) -> NDArray[Any]:
    """The first `size` rows, and rows of `filler` behind the last one."""
    padded = np.full((size, *rows.shape[1:]), filler, dtype)
    padded[: len(rows)] = rows[:size]
    return padded
