# SPDX-License-Identifier: Apache-2.0
"""DAE files: numbering, units, nodes, what is rejected; as RViz shows them."""

import io
import sys
import zipfile

import numpy as np
import pytest

from hpccd_core import MeshFileError, load_mesh
from hpccd_core.mesh_files import collada

pytest.importorskip("collada")

# Vertex 4 is in no face, and 5 repeats 0.
VERTICES = np.array([[2, 0, 0], [0, 1, 0], [1, 5, 0.125], [2, 2, 1], [7, 7, 7], [2, 0, 0]], np.float64)
TRIANGLES = np.array([[2, 1, 0], [5, 3, 2]])
PLACED = '<node><instance_geometry url="#g"/></node>'


def words(array):
    return " ".join(str(x) for x in np.ravel(array))


def triangles(faces=TRIANGLES):
    source = '<input semantic="VERTEX" source="#v" offset="0"/>'
    return f'<triangles count="{len(faces)}">{source}<p>{words(faces)}</p></triangles>'


def dae(*, primitives=None, nodes=PLACED, asset="", more="", vertices=VERTICES):
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><created>2030-01-31T00:00:00</created><modified>2030-01-31T00:00:00</modified>{asset}</asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="a" count="{vertices.size}">{words(vertices)}</float_array>
      <technique_common><accessor source="#a" count="{len(vertices)}" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    {triangles() if primitives is None else primitives}
  </mesh></geometry></library_geometries>{more}
  <library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""


@pytest.fixture
def load(tmp_path):
    def load(text, name="m.dae"):
        file = tmp_path / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_mesh(str(file))

    return load


def test_numbering_is_that_of_the_file(load):
    vertices, faces = load(dae(), "M.DAE")
    assert np.array_equal(vertices, VERTICES) and np.array_equal(faces, TRIANGLES)
    assert vertices.dtype == np.float64 and faces.dtype == np.uint32


@pytest.mark.parametrize("axis", ["X_UP", "Y_UP", "Z_UP"])
def test_the_unit_counts_and_the_axis_does_not(load, axis):
    """RViz has Assimp ignore the axis."""
    vertices, _ = load(dae(asset=f'<unit name="inch" meter="0.0254"/><up_axis>{axis}</up_axis>'))
    assert np.array_equal(vertices, VERTICES * 0.0254)


@pytest.mark.parametrize("meter", ["0", "-1", "nan", "inf"])
def test_units_that_cannot_be(load, meter):
    with pytest.raises(MeshFileError, match=r"m\.dae: its unit is .* metres; it must be"):
        load(dae(asset=f'<unit name="none" meter="{meter}"/>'))


def test_nodes_place_each_instance(load):
    inner = '<node id="in"><translate>0 0 5</translate><instance_geometry url="#g"/></node>'
    again = '<node><instance_node url="#in"/></node>'
    nodes = f'<node><rotate>0 0 1 90</rotate><scale>2 2 2</scale><instance_node url="#in"/></node>{PLACED}{again}'
    more = f"<library_nodes>{inner}</library_nodes>"
    vertices, faces = load(dae(nodes=nodes, more=more, asset='<unit name="cm" meter="0.01"/>'))
    n = len(VERTICES)
    turned = np.stack([-VERTICES[:, 1], VERTICES[:, 0], VERTICES[:, 2] + 5], axis=1) * 2
    expected = np.concatenate([turned, VERTICES, VERTICES + [0, 0, 5]]) * 0.01
    assert np.allclose(vertices, expected, rtol=0, atol=1e-7)
    assert np.array_equal(faces, np.concatenate([TRIANGLES, TRIANGLES + n, TRIANGLES + 2 * n]))


def test_polygons_become_fans_and_primitives_share_positions(load):
    source = '<input semantic="VERTEX" source="#v" offset="0"/>'
    polylist = f'<polylist count="2">{source}<vcount>4 3</vcount><p>0 1 2 3 3 2 1</p></polylist>'
    lines = f'<lines count="1">{source}<p>0 1</p></lines>'
    vertices, faces = load(dae(primitives=lines + polylist + triangles([[1, 2, 4]])))
    assert np.array_equal(vertices, VERTICES)
    assert sorted(map(sorted, faces.tolist())) == [[0, 1, 2], [0, 2, 3], [1, 2, 3], [1, 2, 4]]


def test_polygons_that_are_not_convex_are_split(load):
    ell = np.array([[2.0, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0, 0, 0], [2, 0, 0]])
    source = '<input semantic="VERTEX" source="#v" offset="0"/>'
    for polygons in (
        f'<polylist count="1">{source}<vcount>6</vcount><p>0 1 2 3 4 5</p></polylist>',
        f'<polygons count="1">{source}<p>0 1 2 3 4 5</p></polygons>',
    ):
        vertices, faces = load(dae(primitives=polygons, vertices=ell))
        corners = vertices[faces]
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
        assert len(faces) == 4 and (areas > 0).all() and areas.sum() == 3, "a fan would have areas that cancel"


def test_what_a_mesh_looks_like_is_no_matter(load):
    """Its images, effects and materials may be missing."""
    bound = (
        '<node><instance_geometry url="#g"><bind_material><technique_common>'
        '<instance_material symbol="m" target="#nowhere"/></technique_common></bind_material></instance_geometry>'
        '<instance_light url="#nowhere"/><instance_camera url="#nowhere"/></node>'
    )
    more = '<library_materials><material id="m"><instance_effect url="#nowhere"/></material></library_materials>'
    vertices, faces = load(dae(nodes=bound, more=more))
    assert np.array_equal(vertices, VERTICES) and np.array_equal(faces, TRIANGLES)


def bomb():
    """Nodes that instantiate the next one twice, forty times over."""
    chain = "".join(
        f'<node id="n{k}">' + f'<instance_node url="#n{k + 1}"/>' * 2 + "</node>" for k in reversed(range(40))
    )
    return f'<library_nodes><node id="n40"><instance_geometry url="#g"/></node>{chain}</library_nodes>'


def zipped():
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("m.dae", dae())
    return archive.getvalue()


SOURCE = '<input semantic="VERTEX" source="#v" offset="0"/>'
HOLE = f'<polygons count="1">{SOURCE}<ph><p>0 1 2 3</p><h>0 1 2</h></ph></polygons>'
TWO_LISTS = f'<triangles count="2">{SOURCE}<p>0 1 2</p><p>1 2 3</p></triangles>'

ENTITIES = '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">' + "".join(
    f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
)


@pytest.mark.parametrize(
    "text, why",
    [
        ("", "is empty"),
        ("<COLLADA", "m.dae: cannot be read"),
        (b"\xff\xfe\x00", "m.dae: cannot be read"),
        (dae()[:-300], "m.dae: cannot be read"),
        (zipped(), "is a zip archive; unpack it"),
        (dae(primitives=""), "has no triangles"),
        (dae(nodes=""), "has no triangles"),
        (dae(primitives=triangles([[0, 1, 99]])), "m.dae"),
        (dae(primitives=triangles([[0, 1, -2]])), "m.dae"),
        (dae(vertices=VERTICES * 1e300, asset='<unit name="far" meter="1e10"/>'), "m.dae"),
        (dae(nodes='<node><instance_geometry url="#nowhere"/></node>'), "m.dae: cannot be read"),
        (dae(nodes='<node id="a"><instance_node url="#a"/></node>'), "m.dae"),
        (dae(more=bomb(), nodes='<node><instance_node url="#n0"/></node>'), "more than 100000 nodes; export it flat"),
        (dae(nodes='<node><instance_controller url="#c"/></node>'), "moved by a skeleton or morph"),
        (dae().replace("<scene>", "<!--").replace("</scene>", "-->"), "has no scene; export it again"),
        (dae(vertices=np.where(VERTICES == 7, np.nan, VERTICES)), "a position that is not finite"),
        (dae(primitives=HOLE + triangles()), "polygons with holes"),
        (dae(primitives=TWO_LISTS), "several lists"),
        (dae(primitives=triangles().replace('count="2"', 'count="3"')), "declares 3 triangles but contains 2"),
        (dae(primitives=triangles([[0, 1, 2**32 + 2]])), "a number that is too large"),
        (dae().replace('count="18"', 'count="21"'), "declares 21 numbers but contains 18"),
        (dae().replace('stride="3"', 'stride="6"'), "has other numbers between its positions"),
        (ENTITIES + "]><COLLADA>&j;</COLLADA>", "m.dae: cannot be read"),
    ],
    ids=(
        "empty tag bytes torn zip no-faces no-nodes index negative far reference self bomb skin no-scene nan "
        "hole lists count large-index array-count stride entities"
    ).split(),
)
def test_bad_files_are_rejected(load, text, why):
    with pytest.raises(MeshFileError, match=why) as caught:
        load(text)
    assert len(str(caught.value)) < 800


def test_without_pycollada_it_says_what_to_install(load, monkeypatch):
    monkeypatch.setitem(sys.modules, "collada", None)
    with pytest.raises(MeshFileError, match=r"needs the Python package pycollada; .*pip install pycollada"):
        load(dae())


def test_the_bound_of_nodes_is_far_from_real_files():
    assert collada.MOST_NODES >= 10_000
