# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.mujoco beside MuJoCo: the same positions, names, surfaces, and pairs."""

import itertools
import subprocess
import sys

import numpy as np
import pytest

import hpccd_core as hc

mujoco = pytest.importorskip("mujoco", reason="hpccd_core.mujoco needs the extra mujoco")
from hpccd_core.mujoco import MujocoScene  # noqa: E402

TOLERANCE = 1e-3


def load(bodies, rest="", option=""):
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{bodies}</worldbody>{rest}</mujoco>")
    return model, mujoco.MjData(model)


def flex(dim, **attributes):
    count = {1: "9 1 1", 2: "5 4 1", 3: "4 3 3"}[dim]
    of_flex = {"name": f"flex{dim}", "dim": dim, "count": count, "radius": 0.01} | attributes
    written = " ".join(f'{key}="{value}"' for key, value in of_flex.items())
    return f'<flexcomp type="grid" spacing=".1 .1 .1" mass="1" {written}> <edge equality="true"/> </flexcomp>'


def pairs_in_contact(model, data):
    """Unordered pairs of parts in MuJoCo's contacts."""
    mujoco.mj_forward(model, data)
    pairs = set()
    for contact in data.contact:
        sides = zip(contact.geom.tolist(), contact.flex.tolist(), strict=True)
        pairs.add(frozenset(("geom", g) if g >= 0 else ("flex", f) for g, f in sides))
    return pairs


def pairs_of_hpccd(adapter, data):
    """Unordered pairs of parts of which features touch."""
    near = adapter.detector.proximity(adapter.vertices(data), 0.0)
    return {frozenset(adapter.parts[m] for m in pair) for pair in zip(near.mesh_a, near.mesh_b, strict=True)}


def test_positions_are_those_of_mujoco_after_each_step():
    jelly = flex(3, name="jelly", dof="trilinear").replace("<edge", '<contact selfcollide="none"/> <edge')
    bodies = "".join(flex(dim, pos=f"0 0 {dim}") for dim in (1, 2, 3)) + jelly
    arm = '<body pos="2 0 1"> <joint axis="0 1 0"/> <geom name="ball" size=".1" pos=".5 0 0"/> </body>'
    model, data = load('<geom name="floor" type="plane" size="1 1 .1"/>' + arm + bodies)
    adapter = MujocoScene(model)
    assert adapter.scene.mesh_names == ["flex1", "flex2", "flex3", "jelly", "floor", "ball"]
    assert adapter.scene.layout.vertex_counts == [9, 20, 36, 36, 0, 1]
    for _ in range(20):
        mujoco.mj_step(model, data)
        expected = np.concatenate([data.flexvert_xpos, data.geom_xpos[model.geom("ball").id][None]])
        assert np.array_equal(adapter.vertices(data), expected)
        adapter.step(data)
    assert np.ptp(data.flexvert_xpos[:, 2]) > 1.0


def test_elements_are_numbered_as_in_mujoco_and_shells_enclose():
    model, data = load("".join(flex(dim, pos=f"0 0 {dim}") for dim in (1, 2, 3)))
    scene = MujocoScene(model).scene
    mujoco.mj_forward(model, data)
    first = model.flex_elemdataadr[1]
    cloth = model.flex_elem[first : first + 3 * model.flex_elemnum[1]].reshape(-1, 3)
    faces = hc.Detector(scene)._faces
    assert np.array_equal(faces[: len(cloth)] - 9, cloth)
    shell = data.flexvert_xpos[faces[len(cloth) :]]
    volume = np.einsum("fx,fx->", shell[:, 0], np.cross(shell[:, 1], shell[:, 2])) / 6
    assert volume == pytest.approx(0.3 * 0.2 * 0.2)


L_SHAPE = """<asset> <mesh name="angle" vertex="0 0 0  2 0 0  2 1 0  1 1 0  1 2 0  0 2 0
  0 0 1  2 0 1  2 1 1  1 1 1  1 2 1  0 2 1" face="0 2 1  0 3 2  0 5 3  3 5 4  6 7 8  6 8 9  6 9 11  9 10 11
  0 1 7  0 7 6  1 2 8  1 8 7  2 3 9  2 9 8  3 4 10  3 10 9  4 5 11  4 11 10  5 0 6  5 6 11"/>
  <hfield name="hills" nrow="5" ncol="7" size="1 1.5 .5 .1" elevation="
  0 1 2 0 3 1 0  2 0 1 4 0 1 2  0 3 0 1 2 0 1  1 0 2 0 1 3 0  0 2 0 1 0 2 1"/> </asset>"""
SHAPES = {
    "sphere": 'size=".4"',
    "capsule": 'size=".2 .5"',
    "ellipsoid": 'size=".2 .5 .9"',
    "cylinder": 'size=".4 .6"',
    "box": 'size=".2 .3 .7"',
    "mesh": 'mesh="angle"',
    "hfield": 'hfield="hills"',
}


def beside_a_probe(shape):
    inertia = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    probe = f'<body name="probe"> <freejoint/> {inertia} <geom name="probe" size="1e-6"/> </body>'
    attributes = f'name="it" type="{shape}" {SHAPES[shape]} pos=".1 .2 .3" euler="10 20 30"'
    return load(f'{probe}<body pos="1 2 3" quat=".5 .1 -.7 .3"> <geom {attributes}/> </body>', L_SHAPE)


def gap_to_the_probe(adapter, model, data, point):
    data.qpos[:3] = point
    mujoco.mj_forward(model, data)
    (gap,) = adapter.detector.distances(adapter.vertices(data))
    return gap.distance


@pytest.mark.parametrize("shape", SHAPES)
def test_rays_of_mujoco_end_on_the_surface(shape):
    model, data = beside_a_probe(shape)
    adapter = MujocoScene(model, tolerance=TOLERANCE)
    random, hits, probe = np.random.default_rng(1), 0, model.body("probe").id
    mujoco.mj_forward(model, data)
    centre, pose = data.geom("it").xpos.copy(), data.geom("it").xmat.reshape(3, 3).copy()
    for _ in range(60):
        start, toward = random.normal(size=3) * 3, random.normal(size=3) * 0.3
        if shape == "hfield":  # from above: it has no sides and no base here
            start[2] = abs(start[2]) + 2.0
            start[:2] *= 0.1
        start, toward = centre + pose @ start, pose @ (toward - start)
        length = mujoco.mj_ray(model, data, start, toward, None, 1, probe, np.zeros(1, np.int32), None)
        if length < 0:
            continue
        hits += 1
        gap = gap_to_the_probe(adapter, model, data, start + length * toward)
        assert -1e-5 <= gap + 1e-6 <= TOLERANCE + 1e-5, "on the surface, or inside of it by the tolerance"
    assert hits > 20


@pytest.mark.parametrize("shape", ["sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh"])
def test_distances_are_those_of_mujoco(shape):
    model, data = beside_a_probe(shape)
    adapter = MujocoScene(model, tolerance=TOLERANCE, hulls=True)
    mujoco.mj_forward(model, data)
    random, centre = np.random.default_rng(2), data.geom_xpos[model.geom("it").id].copy()
    for _ in range(30):
        direction = random.normal(size=3)
        gap = gap_to_the_probe(adapter, model, data, centre + direction / np.linalg.norm(direction) * 2.5)
        true = mujoco.mj_geomDistance(model, data, model.geom("probe").id, model.geom("it").id, 10.0, None)
        assert true - TOLERANCE - 1e-5 <= gap <= true + 1e-5


def test_a_mesh_is_its_triangles_or_its_hull():
    model, data = beside_a_probe("mesh")
    volumes = []
    for hulls in (False, True):
        adapter = MujocoScene(model, hulls=hulls)
        gap_to_the_probe(adapter, model, data, [9, 9, 9])
        mesh = adapter.vertices(data)[1:]
        faces = hc.Detector(adapter.scene)._faces - 1
        corners = mesh[faces]
        volumes.append(np.einsum("fx,fx->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)
    assert volumes == pytest.approx([3.0, 3.5])


@pytest.mark.parametrize("seed", range(6))
def test_pairs_are_those_of_mujoco(seed):
    """Everything is at one place: MuJoCo has contacts of all pairs that it tests."""
    random = np.random.default_rng(seed)
    number = itertools.count()

    def geoms(least=0):
        for _ in range(random.integers(least, 3)):
            masks = f'contype="{random.integers(4)}" conaffinity="{random.integers(4)}"'
            yield f'<geom name="g{next(number)}" size="{random.uniform(0.1, 0.2):.3f}" {masks}/>'

    def body(depth):
        joint = random.choice(["<joint/>", "", "<joint/>"])
        inside = "".join(body(depth - 1) for _ in range(random.integers(3))) if depth else ""
        return f'<body name="b{next(number)}">{joint}{"".join(geoms(1))}{inside}</body>'

    def soft(dim):
        return f"""<flexcomp name="f{next(number)}" type="grid" dim="{dim}" count="3 {3 if dim > 1 else 1} 1"
            spacing=".3 .3 .3" radius=".1" mass="1" pos="0 0 .05"> <edge equality="true"/>
            <contact selfcollide="none" contype="{random.integers(4)}" conaffinity="{random.integers(4)}"/>
            </flexcomp>"""

    world = "".join(geoms()) + '<geom name="wall" type="box" size=".1 .1 .1"/>'
    moving = (
        "".join(body(2) for _ in range(4)) + '<body mocap="true" name="hand"> <geom name="palm" size=".1"/> </body>'
    )
    names = [word.split('"')[1] for word in moving.split() if word.startswith('name="b')]
    chosen = [random.choice(names, 2, replace=False) for _ in range(2)]
    excludes = "".join(f'<exclude body1="{a}" body2="{b}"/>' for a, b in chosen)
    option = '<option> <flag filterparent="disable"/> </option>' if seed % 2 else ""
    pair = '<pair geom1="wall" geom2="palm"/>'
    model, data = load(world + moving + soft(1) + soft(2), f"<contact>{excludes}{pair}</contact>", option)
    pairs = pairs_in_contact(model, data)
    assert len(pairs) > 20 and pairs_of_hpccd(MujocoScene(model), data) == pairs


def test_margins_are_separations():
    ball = '<body name="{0}" pos="{1} 0 0"> <freejoint/> <geom name="{0}" size=".1" margin="{2}"/> </body>'
    model, data = load(ball.format("a", 0, 0.03) + ball.format("b", 0.25, 0.01) + ball.format("c", -0.25, 0.03))
    adapter = MujocoScene(model)
    names = {frozenset(model.geom(g).name for _, g in pair) for pair in pairs_in_contact(model, data)}
    assert names == {frozenset("ac")}  # 0.05 apart, within 0.03 + 0.03; a and b within 0.03 + 0.01 only
    end = adapter.vertices(data)
    contacts = adapter.detector.detect(end, end)
    assert contacts.vv.tolist() == [[0, 2]]


def test_elements_pinned_to_a_body_do_not_touch_it():
    floor = '<geom name="floor" type="plane" size="1 1 1" pos="0 0 .015"/>'
    table = '<geom name="table" type="box" size=".15 .15 .02"/>' + floor
    sheet = flex(2, pos="0 0 0.02").replace("</flexcomp>", '<pin id="0 1 2 3"/> </flexcomp>')
    model, data = load(table + sheet)
    mujoco.mj_forward(model, data)
    adapter = MujocoScene(model)
    touched = {int(contact.elem[1]) for contact in data.contact if contact.geom[0] == model.geom("table").id}
    near = adapter.detector.proximity(adapter.vertices(data), 0.0)
    pinned = np.flatnonzero(np.isin(adapter._elements(0), [0, 1, 2, 3]).any(axis=1))
    assert 0 < len(touched) and touched.isdisjoint(pinned)
    of_cloth = near.vf[near.vf[:, 1] < model.flex_elemnum[0], 1]
    assert len(of_cloth) and set(of_cloth.tolist()).isdisjoint(pinned)
    assert {0, 1, 2, 3} <= set(near.vp[:, 0].tolist()), "the plane is tested, as in MuJoCo"


def test_a_thick_flex_is_not_in_contact_with_itself_at_rest():
    model, data = load(flex(2, radius=0.04, pos="0 0 1"))
    adapter = MujocoScene(model)
    mujoco.mj_forward(model, data)
    rest = adapter.vertices(data)
    assert len(adapter.detector.proximity(rest, 0.0)) == 0
    folded = rest.copy()
    folded[rest[:, 0] > 0.05] *= [-1, 1, 1]
    folded[rest[:, 0] > 0.05] += [0, 0, 0.06]
    assert len(adapter.detector.proximity(folded, 0.0)) > 0


def test_nothing_of_another_part_is_taken():
    model, data = load('<geom name="wall" type="box" size="1 1 1"/> <geom size="1"/>' + flex(2) + flex(2, name="other"))
    adapter = MujocoScene(model, flexes=["other"], geoms=[0, 1])
    assert adapter.scene.mesh_names == ["other", "wall", "world/1"] and adapter.parts[0] == ("flex", 1)
    mujoco.mj_forward(model, data)
    assert np.array_equal(adapter.vertices(data)[:20], data.flexvert_xpos[20:])
    assert MujocoScene(model, flexes=[]).scene.mesh_names == ["wall", "world/1"]
    same, _ = load('<geom name="flex2" size="1"/>' + flex(2))
    assert MujocoScene(same).scene.mesh_names == ["flex2", "geom flex2"]


def test_rules_and_options_reach_the_detector():
    model, data = load('<geom name="wall" type="box" size="1 1 1"/>' + flex(2, radius=0.04))
    adapter = MujocoScene(model, outputs=("points",), accuracy="conservative")
    adapter.scene.ignore_pair("flex2", "wall")
    mujoco.mj_forward(model, data)
    for _ in range(2):
        contacts = adapter.step(data)
    assert len(contacts) == 0 and contacts.points.shape == (0, 3) and adapter.detector.accuracy == "conservative"


@pytest.mark.parametrize(
    "attempt, kind, message",
    [
        (lambda m: MujocoScene("a.xml"), TypeError, "model: expected mujoco.MjModel, got str; load one with"),
        (lambda m: MujocoScene(m, geoms=["wal"]), ValueError, "geoms: there is no geom 'wal'; did you mean wall?"),
        (lambda m: MujocoScene(m, flexes="flex2"), TypeError, r"flexes: expected a list .*; write \['flex2'\]"),
        (lambda m: MujocoScene(m, flexes=["flex"]), ValueError, "flexes: there is no flex 'flex'; did you mean flex2?"),
        (
            lambda m: MujocoScene(m, geoms=5),
            TypeError,
            r"geoms: expected a list of names or numbers, got int; write \[5\]",
        ),
        (lambda m: MujocoScene(m, geoms=[9]), ValueError, r"geoms: must lie in \[0, 2\], got 9"),
        (lambda m: MujocoScene(m, geoms=["wall", 0]), ValueError, "geoms: 0 is given twice; list each once"),
        (lambda m: MujocoScene(m, geoms=[], flexes=[]), ValueError, "model: nothing in it can collide; give"),
        (lambda m: MujocoScene(m, tolerance=1e-9), ValueError, "tolerance: 1e-09 needs too many triangles for geom"),
        (lambda m: MujocoScene(m).vertices(m), TypeError, "data: expected mujoco.MjData, got MjModel; make one with"),
        (lambda m: MujocoScene(m).vertices(load(flex(2))[1]), ValueError, "data: geom_xpos has 0 rows, the model 3"),
        (
            lambda m: MujocoScene(m).step(mujoco.MjData(m)),
            ValueError,
            "data: has no positions yet; call mujoco.mj_forw",
        ),
        (lambda m: MujocoScene(m, acuracy="fast").detector, TypeError, "no option 'acuracy'.*did you mean accuracy"),
    ],
)
def test_errors_name_the_remedy(attempt, kind, message):
    model, _ = load(
        '<geom name="wall" type="box" size="1 1 1"/> <geom name="rod" type="cylinder" size="1 1"/>'
        '<geom name="floor" type="plane" size="1 1 1"/>' + flex(2)
    )
    with pytest.raises(kind, match=message):
        attempt(model)


@pytest.mark.parametrize("finite", [True, False])
def test_a_reset_is_no_motion(finite, tmp_path, monkeypatch):
    """A ball that has fallen through the floor goes back above it, by the user or by MuJoCo."""
    monkeypatch.chdir(tmp_path)  # MuJoCo's log of the state that is not finite
    floor = '<geom type="plane" size="1 1 1"/>'
    model, data = load(floor + '<body pos="0 0 1"><freejoint/><geom size=".1" contype="2"/></body>')
    adapter, found = MujocoScene(model), []
    for height in (0.0, -0.5, -2.0):
        data.qpos[2] += height
        mujoco.mj_step(model, data)
        found.append(len(adapter.step(data)))
    assert found == [0, 0, 1]
    if finite:
        mujoco.mj_resetData(model, data)
    else:
        data.qpos[0] = np.nan
    mujoco.mj_step(model, data)
    assert data.geom_xpos[1, 2] == 1.0
    assert not len(adapter.step(data)) and not len(adapter.step(data))


def test_without_mujoco_the_extra_is_named():
    program = "import sys; sys.modules['mujoco'] = None; import hpccd_core.mujoco"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "pip install 'hpccd-core[mujoco]'" in done.stderr.splitlines()[-1]


def test_a_rotating_geom_leaves_its_arc_by_the_documented_distance():
    model, data = load('<body> <joint axis="0 0 1"/> <geom type="box" size=".5 .1 .1"/> </body> <geom size=".1"/>')
    adapter, angle, ends = MujocoScene(model), 0.3, []
    for data.qpos[0] in (0.0, angle / 2, angle):
        mujoco.mj_forward(model, data)
        ends.append(adapter.vertices(data)[:8])
    apart = np.linalg.norm(ends[1] - (ends[0] + ends[2]) / 2, axis=1).max()
    assert apart == pytest.approx(np.hypot(0.5, 0.1) * (1 - np.cos(angle / 2)))


def test_a_plane_that_moves_is_rejected():
    model, _ = load('<body name="lift" mocap="true"> <geom name="top" type="plane" size="1 1 1"/> </body>' + flex(2))
    with pytest.raises(ValueError, match="geoms: plane 'top' is in a body that moves; leave it out of geoms"):
        MujocoScene(model)
