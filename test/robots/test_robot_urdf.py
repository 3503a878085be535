# SPDX-License-Identifier: Apache-2.0
"""Parts of a URDF that are read or rejected: by line and name, with the remedy."""

import math

import pytest

from hpccd_ros.middleware import robot_files
from hpccd_ros.robots import urdf, xml_tree
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.shapes import Box, Capsule, Cylinder, MeshFile, Sphere

LINKS = '<link name="a"/><link name="b"/>'


def robot(inside, links=LINKS):
    return f'<robot name="r">{links}{inside}</robot>'


def joint(inside="", kind="revolute", name="j", parent="a", child="b"):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def shape(inside, use="collision", origin=""):
    return robot("", f'<link name="a"><{use}>{origin}<geometry>{inside}</geometry></{use}></link>')


def test_a_joint_is_read_whole():
    text = robot(
        joint(
            '<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 -2"/>'
            '<limit lower="-1.5" upper="2" effort="1" velocity="1"/><dynamics damping="1"/>'
        )
    )
    found = urdf.parse(text)
    assert (found.name, found.root, [link.name for link in found.links]) == ("r", "a", ["a", "b"])
    (read,) = found.joints
    assert (read.name, read.kind, read.parent, read.child, read.mimic) == ("j", "revolute", "a", "b", None)
    assert read.axis == (0.0, 0.0, -1.0) and read.limits == (-1.5, 2.0)
    assert read.origin.shift.tolist() == [1, 2, 3]
    assert read.origin.quaternion.tolist() == pytest.approx([0, 0, math.sqrt(0.5), math.sqrt(0.5)])


def test_what_is_not_written_has_its_default():
    (read,) = urdf.parse(
        robot(joint("<mimic joint='k'/>") + joint(name="k", child="c"), LINKS + '<link name="c"/>')
    ).joints[:1]
    assert read.axis == (1.0, 0.0, 0.0) and read.limits is None
    assert (read.mimic.joint, read.mimic.multiplier, read.mimic.offset) == ("k", 1.0, 0.0)
    assert read.origin.shift.tolist() == [0, 0, 0] and read.origin.quaternion.tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize(
    "inside, expected",
    [
        ('<box size="1 2 3"/>', Box((1.0, 2.0, 3.0))),
        ('<cylinder radius="0.5" length="2"/>', Cylinder(0.5, 2.0)),
        ('<sphere radius="1e-2"/>', Sphere(0.01)),
        ('<capsule radius="0.5" length="2"/>', Capsule(0.5, 2.0)),
        (
            '<mesh filename="package://p/a b.stl" scale="1 -1 0.001"/>',
            MeshFile("package://p/a b.stl", (1.0, -1.0, 0.001)),
        ),
    ],
)
def test_shapes_are_read(inside, expected):
    ((part,),) = [link.geometry for link in urdf.parse(shape(inside)).links]
    assert part.shape == expected and part.line == 1


def test_only_the_geometry_asked_for_is_read():
    text = shape('<sphere radius="1"/>', "visual")
    assert urdf.parse(text, "collision").links[0].geometry == ()
    assert urdf.parse(text, "visual").links[0].geometry[0].shape == Sphere(1.0)
    broken = shape("<nothing/>", "visual")
    assert urdf.parse(broken, "collision").links[0].geometry == ()
    with pytest.raises(RobotError, match="geometry: 'both' is not known; choose from collision, visual"):
        urdf.parse(text, "both")


def test_what_others_put_beside_links_is_left_alone():
    text = robot(
        '<transmission name="t"><joint name="j"/></transmission><ros2_control name="c"><joint name="j"/></ros2_control>'
        '<gazebo><link name="x"/></gazebo><material name="m"/>' + joint(kind="fixed")
    )
    assert len(urdf.parse(text).joints) == 1


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "URDF: is not XML"),
        ("<robot>", "URDF: is not XML"),
        ("robot_description", "URDF: is not XML"),
        ("<sdf/>", "line 1: <sdf> is the outermost element; it must be <robot>"),
        ("<robot/>", "<robot> has no <link>"),
        (robot("", "<link/>"), "<link> has no attribute name; add it"),
        (robot("", f'<link name="{"a" * 256}"/>'), "has an invalid name; give one of at most 255 printable"),
        (robot("", '<link name="a\u200bb"/>'), "has an invalid name"),
        (robot("", '<link name="a"/>' * 2), "<link name='a'> is the second link of this name"),
        (robot(joint() * 2), "<joint name='j'> is the second joint of this name"),
        (robot(joint() + joint(name="k")), "has the child 'b', which joint 'j' moves already"),
        (robot(""), "several links that no joint moves \\(a, b\\)"),
        (robot(joint() + joint(name="k", parent="b", child="a")), "has a cycle of joints"),
        (
            robot(joint(), LINKS.replace('"a"', '"c"') + '<link name="a"/>').replace(
                "</robot>", joint(name="k", parent="b", child="a") + "</robot>"
            ),
            "has joints in a cycle: j, k",
        ),
        (robot(joint(parent="x")), "<joint name='j'> has the parent 'x', which is not a link; links are a, b"),
        (robot(joint(child="a")), "one link as parent and child"),
        (robot('<joint name="j" type="fixed"><child link="b"/></joint>'), "<joint name='j'> has no <parent>"),
        (robot(joint('<parent link="a"/>')), "<parent> is the second in <joint>"),
        (robot(joint(kind="floating")), "<joint name='j'> is floating, so no single value moves it"),
        (robot(joint(kind="planar")), "<joint name='j'> is planar"),
        (robot(joint(kind="hinge")), "<joint name='j'> has the type 'hinge'; choose from revolute"),
        (robot(joint('<axis xyz="0 0 0"/>')), "<joint name='j'> has an invalid axis"),
        (robot(joint('<axis xyz="0 0"/>')), "<axis> has xyz='0 0'; it must be 3 finite numbers"),
        (robot(joint('<origin xyz="0 0 nan"/>')), "<origin> has xyz='0 0 nan'"),
        (robot(joint('<origin rpy="0 0 ${pi}"/>')), "<origin> has rpy="),
        (robot(joint('<limit lower="1" upper="0"/>')), "<joint name='j'> has the lower limit 1 above the upper one 0"),
        (robot(joint('<mimic joint="x"/>')), "has the joint 'j', which mimics 'x': there is no such joint"),
        (robot(joint('<mimic joint="j"/>')), "mimic each other in a cycle: j, j"),
        (robot(joint('<mimic joint="j" multiplier="x"/>')), "<mimic> has multiplier='x'; it must be a finite number"),
        (shape(""), "<geometry> has 0 shapes; it needs one"),
        (shape('<box size="1 1 1"/>' * 2), "<geometry> has 2 shapes"),
        (shape("<torus/>"), "<torus> is not a known shape; choose from box"),
        (robot(joint('<limit lower="nan" upper="1"/>')), "<limit> has lower='nan'; it must be a finite number"),
        (shape('<box size="1 -1 1"/>'), "<box> has size -1; lengths must not be negative"),
        (shape('<box size="1 0 0"/>'), "<box> has size 1 0 0, which leaves no surface; give two lengths above 0"),
        (shape('<box size="nan 1 1"/>'), "<box> has size='nan 1 1'; it must be 3 finite numbers with spaces between"),
        (shape('<sphere radius="0"/>'), "<sphere> has radius 0; give a length above 0, or remove the shape"),
        (shape('<cylinder radius="1" length="-0.0"/>'), "<cylinder> has length -0; give a length above 0"),
        (shape('<capsule radius="inf" length="1"/>'), "<capsule> has radius='inf'; it must be a finite number"),
        (shape("<sphere/>"), "<sphere> has no radius; add the attribute with a finite number"),
        (shape('<cylinder radius="1"/>'), "<cylinder> has no length; add the attribute with a finite number"),
        (shape('<box size=" "/>'), "<box> has no size; add the attribute with 3 finite numbers with spaces between"),
        (shape('<mesh filename=""/>'), "<mesh> has no attribute filename; add it"),
        (shape('<mesh filename="a.stl" scale="1 0 1"/>'), "<mesh> has the scale 1 0 1"),
        (
            '<robot xmlns:xacro="x">\n<xacro:include filename="a"/></robot>',
            "line 2: .* is a xacro element; expand the file first",
        ),
    ],
)
def test_what_cannot_be_used_is_rejected_by_name(text, message):
    with pytest.raises(RobotError, match=message):
        urdf.parse(text)


BOMB = """<?xml version="1.0"?>
<!DOCTYPE robot [<!ENTITY a "{ha}"><!ENTITY b "{many_a}"><!ENTITY c "{many_b}">]>
<robot name="&c;"><link name="a"/></robot>""".format(ha="ha" * 100, many_a="&a;" * 1000, many_b="&b;" * 1000)


@pytest.mark.parametrize(
    "text, message",
    [
        (BOMB, "URDF, line 2: has a document type"),
        ('<!DOCTYPE robot SYSTEM "http://example.org/a.dtd"><robot/>', "has a document type"),
        ('<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot name="&a;"/>', "has a document type"),
        ("<robot name='&a;'/>", "is not XML: undefined entity"),
        ("<robot>" + "<a>" * 100, "is nested more than 50 elements deep"),
        ("<robot>" + "<a/>" * (xml_tree.MOST_ELEMENTS + 1), "is one element too many"),
        ("<robot>" + " " * xml_tree.MOST_CHARACTERS, "16000000 are allowed"),
        ("<robot name='\ud800'/>", "is not text"),
        ("<robot name='\0'/>", "is not XML"),
        ("<robot a='1' a='2'/>", "is not XML: duplicate attribute"),
    ],
    ids=["bomb", "network", "file", "undefined", "deep", "many", "long", "surrogate", "zero", "twice"],
)
def test_hostile_xml_is_rejected(text, message):
    with pytest.raises(RobotError, match=message) as rejected:
        urdf.parse(text)
    assert len(str(rejected.value)) < 1000


def of_file(tmp_path, data):
    file = tmp_path / "robot.urdf"
    file.write_bytes(data)
    return robot_files.text_of(str(file))


@pytest.mark.parametrize(
    "declared, encoding",
    [
        ("", "utf-8"),
        ("", "utf-8-sig"),
        ("", "utf-16"),
        ("", "utf-32"),
        ("UTF-16", "utf-16"),
        ("UTF-16LE", "utf-16-le"),
        ("UTF-16", "utf-16-be"),
        ("UTF-16", "utf-8"),  # as editors leave it that save as UTF-8
        ("ISO-8859-1", "latin-1"),
        ("iso-8859-15", "iso-8859-15"),
        ("Windows-1252", "cp1252"),
        ("Shift_JIS", "shift_jis"),
    ],
)
def test_a_file_is_read_by_its_encoding(tmp_path, declared, encoding):
    name = "腕" if encoding == "shift_jis" else "hüfte"
    head = f'<?xml version="1.0" encoding="{declared}"?>\n' if declared else ""
    text = of_file(tmp_path, f'{head}<robot name="r"><link name="{name}"/></robot>'.encode(encoding))
    assert urdf.parse(text).root == name


@pytest.mark.parametrize(
    "data, message",
    [
        ("\n<robot name='ü'/>".encode("latin-1"), r"robot.urdf: is not UTF-8 \(byte 0xfc in line 2\); save it"),
        (b"<?xml version='1.0' encoding='klingon'?><robot/>", "declares the encoding 'klingon', which is unknown"),
        (b"<?xml version='1.0' encoding='zip'?><robot/>", "declares the encoding 'zip', which is unknown; save it"),
        (b"<?xml version='1.0' encoding='idna'?><robot name='xn--\xff'/>", "save it as UTF-8"),
        (b"\xff\xfe<\0r", "is not UTF-16"),
    ],
)
def test_a_file_in_no_known_encoding_says_what_to_do(tmp_path, data, message):
    with pytest.raises(RobotError, match=message):
        of_file(tmp_path, data)


def test_bytes_that_were_sent_as_if_they_were_utf_8_say_what_to_do():
    """rclpy puts U+FFFD in place of bytes that are not UTF-8."""
    latin = '<?xml version="1.0" encoding="ISO-8859-1"?>\n<!-- Müller --><robot name="r"><link name="{}"/></robot>'
    sent = latin.format("arm").encode("latin-1").decode("utf-8", "replace")
    assert urdf.parse(sent).root == "arm"  # lost in a comment alone
    with pytest.raises(RobotError, match="<link name='h.fte'> has characters in name that were not sent as UTF-8"):
        urdf.parse(latin.format("hüfte").encode("latin-1").decode("utf-8", "replace"))
    with pytest.raises(RobotError, match="URDF: is UTF-16, which was sent as if it were UTF-8; save it as UTF-8"):
        urdf.parse(latin.format("arm").encode("utf-16").decode("utf-8", "replace"))


def test_names_of_links_and_joints_may_hold_what_separates_names_of_meshes():
    links = '<link name="base/left:1"/><link name="arm:/tip"/>'
    found = urdf.parse(robot(joint(name="left/j:1", parent="base/left:1", child="arm:/tip"), links))
    assert (found.root, found.joints[0].name) == ("base/left:1", "left/j:1")


def test_the_encoding_that_a_text_declares_does_not_matter():
    text = '<?xml version="1.0" encoding="iso-8859-1"?><robot name="ä"><link name="ö"/></robot>'
    assert urdf.parse(text).root == "ö"
    assert urdf.parse(text.replace("iso-8859-1", "utf-16")).name == "ä"


def test_a_long_chain_of_links_is_no_recursion():
    count = urdf.MOST_LINKS
    links = "".join(f'<link name="l{k}"/>' for k in range(count))
    joints = (joint(kind="fixed", name=f"j{k}", parent=f"l{k - 1}", child=f"l{k}") for k in range(1, count))
    assert len(urdf.parse(robot("".join(joints), links)).joints) == count - 1
    with pytest.raises(RobotError, match="has 1001 links; at most 1000 are allowed"):
        urdf.parse(robot("", links + '<link name="more"/>'))
