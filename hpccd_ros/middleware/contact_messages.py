# SPDX-License-Identifier: Apache-2.0
"""Contacts of the core <-> ContactArray."""

from array import array
from dataclasses import dataclass

import numpy as np
from hpccd.msg import ContactArray
from numpy.typing import NDArray

from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware.feature_pairs import FeaturePairs, fill_pairs, read_pairs
from hpccd_ros.middleware.fields import to_field, zeros


def fill_contacts(
    message: ContactArray,
    contacts,
    layout: Layout,
    *,
    max_contacts: int = 0,
    outputs: tuple[str, ...] = ("points", "normals", "closest"),
) -> None:
    """Write the core's ``Contacts`` into ``message`` (all but header, start, step, accuracy, backend, drops and the
    separation).

    max_contacts: 0: all; else only that many of the earliest, still in canonical order (of equal times those
    first in it); ``total``, ``first_toc`` and ``hash`` are of all contacts found.
    outputs: which of points, normals and closest to send, where the core has computed them.
    """
    pairs, vf_toc, ee_toc = FeaturePairs.of(contacts.vf, contacts.ee), contacts.vf_toc, contacts.ee_toc
    total = len(pairs)
    computed = {name: getattr(contacts, name, None) for name in outputs}
    sent = {name: values for name, values in computed.items() if values is not None and len(values) == total}
    truncated = 0 < max_contacts < total
    if truncated:
        keep = lowest(np.concatenate([vf_toc, ee_toc]), max_contacts)
        n_vf = len(pairs.vf)
        pairs = pairs.keep(keep)
        vf_toc, ee_toc = vf_toc[keep[keep < n_vf]], ee_toc[keep[keep >= n_vf] - n_vf]
        sent = {name: values[keep] for name, values in sent.items()}
    fill_pairs(message, pairs, layout)
    toc = zeros("d", len(pairs))
    np.concatenate([vf_toc, ee_toc], out=np.frombuffer(toc))
    message.toc = toc
    fill_names(message, layout)
    for name, values in sent.items():
        setattr(message, name, to_field(values))
    message.first_toc = float(contacts.first_toc)
    message.total, message.truncated, message.hash = total, truncated, int(contacts.hash)


def fill_names(message, layout: Layout) -> None:
    """Write which meshes, and which versions of their topologies, the indices are of."""
    message.mesh_names = list(layout.mesh_names)
    message.topology_versions = array("I", layout.topology_versions)


def lowest(values: np.ndarray, count: int) -> np.ndarray:
    """Indices of the ``count`` smallest values in ascending order of index; ties go to the lower index."""
    threshold = np.partition(values, count - 1)[count - 1]
    before = np.flatnonzero(values < threshold)
    ties = np.flatnonzero(values == threshold)[: count - len(before)]
    return np.sort(np.concatenate([before, ties]))


@dataclass(frozen=True, eq=False)
class SceneContacts:
    """A ContactArray in the scene-wide numbering of the core, with the names, shapes and dtypes of
    hpccd_core.Contacts, Proximity (``vf_distance``, ``ee_distance``) and Intersections (``ef``); what the message does
    not hold is empty."""

    vf: NDArray[np.uint32]
    vf_toc: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    closest: NDArray[np.float64]
    vf_distance: NDArray[np.float64]
    ee_distance: NDArray[np.float64]
    ef: NDArray[np.uint32]


def other_topologies(message: ContactArray, layout: Layout) -> str | None:
    """In words, where both tell the versions of their topologies and these differ; else None."""
    of_message, of_layout = tuple(message.topology_versions), layout.topology_versions
    if not of_message or not of_layout or of_message == of_layout:
        return None
    return f"the contacts are of topology versions {list(of_message)}, the layout is of {list(of_layout)}"


def read_contacts(message: ContactArray, layout: Layout) -> SceneContacts:
    """The inverse of fill_contacts (what was cut off stays cut off). points, normals: (N,3) or (0,3); closest: (N,2,3)
    or (0,2,3).

    Raises ValueError where the message belongs to other versions of the topologies than the layout.
    """
    if why := other_topologies(message, layout):
        raise ValueError(f"layout: {why}; make it of the topologies of these versions")
    pairs = read_pairs(message, layout)
    toc, distance = np.frombuffer(message.toc, np.float64), np.frombuffer(message.distance, np.float64)
    n_vf = len(pairs.vf)
    return SceneContacts(
        pairs.vf,
        toc[:n_vf],
        pairs.ee,
        toc[n_vf:],
        np.frombuffer(message.points, np.float64).reshape(-1, 3),
        np.frombuffer(message.normals, np.float64).reshape(-1, 3),
        np.frombuffer(message.closest, np.float64).reshape(-1, 2, 3),
        distance[:n_vf],
        distance[n_vf:],
        pairs.ef,
    )
