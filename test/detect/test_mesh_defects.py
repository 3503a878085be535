# SPDX-License-Identifier: Apache-2.0
"""Defects of meshes: each one planted is found, and nothing in sound meshes."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_ros.detect.mesh_defects import examine


def sheet():
    """17 by 17 vertices at a spacing of 0.125."""
    return hc.shapes.grid(16, 16)


def found(vertices, faces, distance=None):
    return {d.name: d.indices.tolist() for d in examine(vertices, faces, distance).defects}


@pytest.mark.parametrize("mesh", [hc.shapes.icosphere(3), hc.shapes.box((1, 2, 3)), sheet()])
def test_sound_meshes_have_none(mesh):
    report = examine(*mesh)
    assert report.defects == () and report.components == report.components_if_welded == 1
    assert report.closed == report.closed_if_welded == hc.closed(mesh[1]) == (report.boundary_edges == 0)
    scene = hc.Scene()
    scene.add_mesh("mesh", mesh[1])
    assert report.smallest_gap == hc.Detector(scene).distances(mesh[0])[0].distance > 0


def test_a_soup_of_triangles_is_a_closed_sphere_once_it_is_welded():
    vertices, faces = hc.shapes.icosphere(2)
    soup = vertices[faces].reshape(-1, 3)
    report = examine(soup, np.arange(len(soup)).reshape(-1, 3))
    assert (report.components, report.components_if_welded) == (len(faces), 1)
    assert (report.closed, report.closed_if_welded) == (False, True)
    (defect,) = report.defects
    assert defect.name == "doubled vertices" and len(defect.indices) == len(soup) - len(vertices)
    later, first = defect.indices.T
    assert (later > first).all() and np.array_equal(soup[later], soup[first])


def test_seams_within_the_distance():
    vertices, faces = sheet()
    n = len(vertices)
    seam = np.flatnonzero(vertices[:, 0] == 1)
    both = np.vstack([vertices, vertices + [2 + 1e-5, 0, 0]])
    panels = np.vstack([faces, faces + np.uint32(n)])
    wanted = [[n + k - 16, k] for k in seam]
    assert found(both, panels) == {"nearly doubled vertices": wanted}
    assert found(both, panels, 1e-6) == {}
    both[n:, 0] -= 1e-5
    assert found(both, panels, 0.0) == {"doubled vertices": wanted}


def t_junctions(vertices, faces, distance):
    """All vertices against all edges of faces that do not contain them."""
    edges = {tuple(sorted((int(f[k]), int(f[k - 1])))) for f in faces for k in range(3)}
    rows = []
    for v in np.unique(faces):
        for a, b in sorted(edges):
            if v in (a, b):
                continue
            p, u, w = vertices[v], vertices[a], vertices[b]
            t = (p - u) @ (w - u) / ((w - u) @ (w - u))
            gap = np.linalg.norm(u + np.clip(t, 0, 1) * (w - u) - p)
            if gap <= distance < min(np.linalg.norm(p - u), np.linalg.norm(p - w)) and 0 < t < 1:
                rows.append([int(v), a, b])
    return rows


@pytest.mark.parametrize("seed", range(6))
def test_t_junctions_equal_brute_force(seed):
    random = np.random.default_rng(seed)
    coarse, coarse_faces = hc.shapes.grid(3, 3)
    fine, fine_faces = hc.shapes.grid(6, 6)
    vertices = np.vstack([coarse, fine + [2, 0, 0]]) + random.normal(scale=3e-5, size=(len(coarse) + len(fine), 3))
    faces = np.vstack([coarse_faces, fine_faces + np.uint32(len(coarse))])
    distance = 1e-4
    welded, triangles, index = hc.weld(vertices, faces, distance)
    first = np.unique(index, return_index=True)[1]
    wanted = [[int(first[k]) for k in row] for row in t_junctions(welded, triangles, distance)]
    assert found(vertices, faces, distance).get("T-junctions", []) == sorted(wanted)
    assert wanted, "this scene has some"


def test_faces_and_edges():
    vertices, faces = sheet()
    a, b, c = faces[40].tolist()
    assert found(vertices, np.vstack([faces, [[a, b, b]]])) == {"faces without area": [[len(faces)]]}
    flat = np.vstack([vertices, [[0, 0, 1e-300], [0.1, 0.3, 5], [0.2, 0.6, 10], [0.3, 0.9, 15]]])
    n = len(vertices)
    lone = found(flat, np.vstack([faces, [[n + 1, n + 2, n + 3]]]))
    # 0.3 is not three times 0.1 in binary numbers: this face has an area, of about 1e-17.
    assert "faces without area" not in lone and lone["isolated vertices"] == [[n]]
    flat[n + 1 :] = [[1, 3, 5], [2, 6, 10], [3, 9, 15]]
    assert found(flat, np.vstack([faces, [[n + 1, n + 2, n + 3]]]))["faces without area"] == [[len(faces)]]
    assert found(vertices, np.vstack([faces, [[b, c, a]]]))["faces that occur twice"] == [[len(faces), 40]]
    turned = faces.copy()
    turned[40] = turned[40, ::-1]
    edges = sorted(sorted(pair) for pair in ((a, b), (b, c), (c, a)))
    assert found(vertices, turned) == {"edges with faces of opposite orientation": edges}
    fin = np.vstack([vertices, vertices[a] + [0.01, 0.02, 1]])
    branch = found(fin, np.vstack([faces, [[a, b, n]]]))
    assert branch == {"edges in more than two faces": [sorted((a, b))]}


def test_only_faces_without_area():
    report = examine(np.zeros((2, 3)), np.array([[0, 1, 1]], np.uint32))
    assert [d.name for d in report.defects] == ["doubled vertices", "faces without area"]
    assert report.smallest_gap == np.inf and report.shortest_edge == report.median_edge == 0


def test_self_intersections_are_numbered_as_in_the_mesh():
    ball, faces = hc.shapes.icosphere(2)
    n, m = len(ball), len(faces)
    # Doubled corners of a face before the balls, and a face that welding leaves out: numbers differ in the welded mesh.
    vertices = np.concatenate([ball[faces[0]], ball, ball + [0.7, 0.05, 0.02]])
    both = np.concatenate([[[0, 1, 2]], [[0, 3 + faces[0, 0], 1]], faces[1:] + 3, faces + 3 + n]).astype(np.uint32)
    scene = hc.Scene()
    scene.add_mesh("a", faces, self_collision=False)
    scene.add_mesh("b", faces, self_collision=False)
    ef = hc.Detector(scene).intersections(vertices[3:]).ef.astype(int)
    corner = {int(k): i for i, k in enumerate(faces[0])}
    expected = sorted(
        sorted(corner.get(v, v + 3) for v in row[:2]) + [0 if row[2] == 0 else int(row[2]) + 1] for row in ef.tolist()
    )
    got = found(vertices, both)
    assert len(expected) > 10 and sorted(sorted(r[:2]) + r[2:] for r in got["self-intersections"]) == expected
    assert "self-intersections" not in found(vertices[: 3 + n], both[: m + 1])


def test_t_junctions_are_no_self_intersections():
    vertices = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 0], [0, -1, 0], [2, -1, 0]], float)
    faces = np.array([[0, 1, 2], [0, 3, 4], [3, 1, 5], [3, 4, 5]], np.uint32)
    assert found(vertices, faces).keys() == {"T-junctions", "edges with faces of opposite orientation"}
