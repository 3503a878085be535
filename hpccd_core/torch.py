# SPDX-License-Identifier: Apache-2.0
"""Times of impact and distances as differentiable functions of PyTorch tensors.

Positions are float32 or float64 tensors of any device: they are copied to the host, where the detector takes them.
Results are float64, on the device of the first tensor. Gradients are those of :meth:`Contacts.toc_gradients` and of
`Proximity.weights` and `normals`. They are zero where there is no derivative: at a time of 0, for features that only
graze each other, at a distance of 0, and for +inf. There are no second derivatives.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from . import derivatives
from .contacts import Contacts
from .detector import Detector
from .device_distances import DeviceDistances
from .proximity import Gap, Proximity

try:
    import torch
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"hpccd_core.torch: cannot import PyTorch ({error}); pip install torch", name=error.name
    ) from None

_AnyDetector = Detector[Any, Any, Any, Any, Any]


class _Question:
    """A query, and what it found: autograd returns tensors only."""

    def __init__(self, ask: Callable[..., tuple[Any, derivatives.Linearization]]) -> None:
        self._ask = ask

    def __call__(self, *positions: Any) -> Any:
        self.found, self.linearization = self._ask(*positions)
        return self.linearization.values


class _Values(torch.autograd.Function):
    @staticmethod
    def forward(question: _Question, *positions: torch.Tensor) -> torch.Tensor:
        return torch.from_numpy(question(*(p.numpy(force=True) for p in positions))).to(positions[0].device)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        question, *positions = inputs
        ctx.save_for_backward(*positions)
        ctx.vertices = torch.from_numpy(question.linearization.vertices.ravel()).to(output.device)
        ctx.gradients = [torch.from_numpy(g).to(output.device) for g in question.linearization.gradients]

    @staticmethod
    def backward(ctx: Any, of_values: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        terms = zip(ctx.needs_input_grad[1:], ctx.gradients, ctx.saved_tensors, strict=True)
        return None, *(_Pullback.apply(of_values, g, ctx.vertices, p) if needed else None for needed, g, p in terms)

    @staticmethod
    def vmap(*_: Any) -> NoReturn:
        raise NotImplementedError("hpccd_core.torch: no vmap; create the detector with worlds= and give (W, V, 3)")


class _Pullback(torch.autograd.Function):
    """The gradient with respect to positions. It depends on them: without this class second derivatives would be 0."""

    generate_vmap_rule = True

    @staticmethod
    def forward(
        of_values: torch.Tensor, gradient: torch.Tensor, vertices: torch.Tensor, positions: torch.Tensor
    ) -> torch.Tensor:
        # Zeros stay zeros, also where the loss is infinite because a time is.
        rows = torch.where(gradient == 0, 0.0, of_values[:, None, None] * gradient)
        total = rows.new_zeros(positions.numel() // 3, 3).index_add(0, vertices, rows.reshape(-1, 3))
        return total.reshape(positions.shape).to(positions)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, *_: torch.Tensor) -> NoReturn:
        raise NotImplementedError(
            "hpccd_core.torch: times and distances have first derivatives only; differentiate once"
        )


def _evaluate(ask: Callable[..., Any], **positions: torch.Tensor) -> tuple[torch.Tensor, Any]:
    for name, tensor in positions.items():
        if not isinstance(tensor, torch.Tensor):
            remedy = f"use torch.as_tensor({name})"
            if isinstance(tensor, Mapping):
                remedy = "use torch.cat of the meshes in the order added"
            raise TypeError(f"{name}: expected torch.Tensor, got {type(tensor).__name__}; {remedy}")
        if tensor.layout != torch.strided:
            raise TypeError(f"{name}: expected a dense tensor, got {tensor.layout}; convert with {name}.to_dense()")
        if tensor.dtype not in (torch.float32, torch.float64):
            raise TypeError(f"{name}: expected float32 or float64, got {tensor.dtype}; convert with {name}.double()")
    question = _Question(ask)
    return _Values.apply(question, *positions.values()), question.found


def times_of_impact(
    detector: _AnyDetector, vertices_t0: torch.Tensor, vertices_t1: torch.Tensor
) -> tuple[torch.Tensor, Contacts]:
    """The time of impact of each contact.

    Parameters
    ----------
    detector : Detector
        With outputs=("normals", "weights").
    vertices_t0, vertices_t1 : torch.Tensor, shape (V, 3) or (W, V, 3)

    Returns
    -------
    times : torch.Tensor, shape (N+M,), float64
        Vertex-face contacts, then edge-edge contacts.
    contacts : Contacts
        What :meth:`Detector.detect` returns.

    Raises
    ------
    TypeError, ValueError
        For other arguments, as :meth:`Detector.detect` does.
    """
    derivatives.check(detector)
    return _evaluate(functools.partial(derivatives.times, detector), vertices_t0=vertices_t0, vertices_t1=vertices_t1)


def first_time_of_impact(detector: _AnyDetector, vertices_t0: torch.Tensor, vertices_t1: torch.Tensor) -> torch.Tensor:
    """The earliest time of impact.

    Parameters
    ----------
    detector : Detector
        With outputs=("normals", "weights"), and not with report="any".
    vertices_t0, vertices_t1 : torch.Tensor, shape (V, 3) or (W, V, 3)

    Returns
    -------
    torch.Tensor, shape () or (W,), float64
        +inf, without a gradient, if there are no contacts. Of several contacts at this time, the first in order has
        the gradient.

    Raises
    ------
    TypeError, ValueError
        For other arguments, as :meth:`Detector.detect` does.

    Examples
    --------
    >>> import torch
    >>> import hpccd_core as hc
    >>> from hpccd_core import torch as hct
    >>> scene = hc.Scene()
    >>> _ = scene.add_mesh("falling", [[0, 1, 2]])
    >>> _ = scene.add_mesh("ground", [[0, 1, 2]], static=True)
    >>> detector = hc.Detector(scene, outputs=("normals", "weights"))
    >>> ground = torch.tensor([[-5.0, -5, 0], [5, -5, 0], [0, 5, 0]])
    >>> triangle = torch.tensor([[0.0, 0, 1], [1, 0, 3], [0, 1, 3]], requires_grad=True)
    >>> start, end = torch.cat([triangle, ground]), torch.cat([triangle - torch.tensor([0, 0, 2]), ground])
    >>> time = hct.first_time_of_impact(detector, start, end)
    >>> time.backward()
    >>> time.item(), triangle.grad[0].tolist()  # half a unit later for each unit that it begins higher
    (0.5, [0.0, 0.0, 0.5])
    """
    derivatives.check_earliest(detector)

    def ask(start: object, end: object) -> tuple[None, derivatives.Linearization]:
        return None, derivatives.first_times(detector, start, end)

    times, _ = _evaluate(ask, vertices_t0=vertices_t0, vertices_t1=vertices_t1)
    return times if detector.worlds is not None else times[0]


def proximity_distances(
    detector: _AnyDetector, vertices: torch.Tensor, distance: float
) -> tuple[torch.Tensor, Proximity]:
    """The distance of each pair of features that are within `distance` of each other.

    Parameters
    ----------
    detector : Detector
        With outputs=("normals", "weights").
    vertices : torch.Tensor, shape (V, 3) or (W, V, 3)
    distance : float
        As in :meth:`Detector.proximity`.

    Returns
    -------
    distances : torch.Tensor, shape (N+M,), float64
        Vertex-face pairs, then edge-edge pairs.
    near : Proximity
        What :meth:`Detector.proximity` returns.

    Raises
    ------
    TypeError, ValueError
        For other arguments, as :meth:`Detector.proximity` does.
    """
    derivatives.check(detector)
    return _evaluate(functools.partial(derivatives.proximity, detector, distance=distance), vertices=vertices)


def smallest_distances(
    detector: _AnyDetector, vertices: torch.Tensor
) -> tuple[torch.Tensor, list[Gap] | list[list[Gap]] | DeviceDistances]:
    """The smallest distance of each pair of meshes.

    Parameters
    ----------
    detector : Detector
    vertices : torch.Tensor, shape (V, 3) or (W, V, 3)

    Returns
    -------
    distances : torch.Tensor, shape (P,) or (W, P), float64
        In the order of `gaps`; 0 where meshes intersect, +inf where no pair of features exists.
    gaps : list of Gap, list of W such lists with worlds, or DeviceDistances
        What :meth:`Detector.distances` returns.

    Raises
    ------
    TypeError, ValueError
        For other arguments, as :meth:`Detector.distances` does.
    """
    derivatives.check(detector, outputs=())
    distances, gaps = _evaluate(functools.partial(derivatives.smallest_distances, detector), vertices=vertices)
    return (distances if detector.worlds is None else distances.reshape(detector.worlds, -1)), gaps
