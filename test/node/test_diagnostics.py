# SPDX-License-Identifier: Apache-2.0
"""The content of /diagnostics, and the markers."""

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from visualization_msgs.msg import Marker

from hpccd_ros.frames.drops import Input, Reason, Rejection
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.markers import contact_markers
from hpccd_ros.node.metrics import percentiles
from hpccd_ros.node.status_report import Reporter


class Fixture:
    def __init__(self):
        self.log = []
        self.accounts = Accounts(self.log.append)
        self.metrics = self.accounts.metrics
        self.reporter = Reporter("/hpccd", self.accounts)

    def report(self, **changes):
        given = {"state": "active", "waiting": 0, "warnings": [], "service": {}} | changes
        message = self.reporter.report(Time(sec=3), **given)
        assert message.header.stamp.sec == 3
        return {s.name: (s.level, s.message, {v.key: v.value for v in s.values}) for s in message.status}


def test_quiet_node_is_stale():
    level, text, _ = Fixture().report()["/hpccd: frames"]
    assert level == DiagnosticStatus.STALE and "no frames" in text


def test_frames_and_detections():
    node = Fixture()
    for _ in range(3):
        node.metrics.frame_received("cloth", 2.0)
    node.metrics.first_frame(1)
    node.metrics.detected(2, 8.0, 5.0, {"bvh": 1.0, "total": 4.0}, {"backend": "cpu"})
    report = node.report()
    level, _, values = report["/hpccd: frames"]
    assert level == DiagnosticStatus.OK
    assert values["received"] == values["processed"] == "3" and values["dropped"] == "0"
    assert float(values["rate_hz.cloth"]) > 0
    assert values["transport_ms.p50"] == "2.00"
    level, _, values = report["/hpccd: detection"]
    assert level == DiagnosticStatus.OK
    assert (values["detections"], values["first_frames"], values["backend"]) == ("1", "1", "cpu")
    assert values["latency_ms.p99"] == "8.00" and values["detect_ms.max"] == "5.00"
    assert values["stage_ms.bvh"] == "1.000"
    assert float(report["/hpccd: process"][2]["memory_mb"]) > 1


def test_drops_warn_once_and_stay_counted():
    node = Fixture()
    node.accounts.rejected(Rejection("cloth", Reason.OVERLOAD, messages=4))
    node.accounts.rejected(Rejection("ball", Reason.NOT_FINITE, "vertex 1 is nan"))
    node.accounts.rejected(Rejection("ball", Reason.OLD_TOPOLOGY, "version 1", what=Input.TOPOLOGY))
    level, text, values = node.report()["/hpccd: frames"]
    assert (
        level == DiagnosticStatus.WARN
        and "5 frames dropped (not_finite 1, overload 4)" in text
        and "1 topology rejected" in text
    )
    assert values["dropped"] == "5" and values["dropped.overload"] == "4"
    assert values["dropped.ball.not_finite"] == "1" and values["topologies_rejected.ball.old_topology"] == "1"
    assert values["last_rejection"] == "ball: old_topology: version 1"
    level, _, values = node.report()["/hpccd: frames"]
    assert level == DiagnosticStatus.STALE and values["dropped"] == "5"


def test_what_moves_meshes_is_told_of_where_it_is_rejected():
    node = Fixture()
    for what, key in ((Input.JOINT_STATE, "joint_states_rejected"), (Input.TRANSFORM, "transforms_rejected")):
        node.accounts.rejected(Rejection("topic", Reason.MALFORMED, "stamp has sec -1", what=what))
        level, text, values = node.report()["/hpccd: frames"]
        assert level == DiagnosticStatus.WARN and f"1 {what.removesuffix('s')} rejected" in text
        assert (values[key], values["dropped"]) == ("1", "0")
        assert values["last_rejection"] == "topic: malformed: stamp has sec -1"
        level, text, values = node.report()["/hpccd: frames"]
        assert level == DiagnosticStatus.STALE and values[key] == "1"


def test_failure_is_an_error_until_the_next_success():
    node = Fixture()
    node.metrics.failed("MemoryError: 3 GB")
    level, text, values = node.report()["/hpccd: detection"]
    assert level == DiagnosticStatus.ERROR and "3 GB" in text and values["failures"] == "1"
    node.metrics.detected(1, 1.0, 1.0, {}, {})
    assert node.report()["/hpccd: detection"][0] == DiagnosticStatus.OK


def test_warnings_are_told():
    node = Fixture()
    node.accounts.connections["message_lost.x"] += 3
    level, text, values = node.report(warnings=["2 publishers on /x"])["/hpccd: frames"]
    assert level == DiagnosticStatus.WARN and "2 publishers" in text and values["message_lost.x"] == "3"


def test_silent_inputs_are_named_and_stay_stale_while_nothing_comes():
    node = Fixture()
    silent = ["/meshes/cloth/vertices: it has no publisher"]
    level, text, values = node.report(warnings=[], silent=silent)["/hpccd: frames"]
    assert level == DiagnosticStatus.STALE and text.endswith(" s; /meshes/cloth/vertices: it has no publisher")
    assert values["warning.1"] == silent[0]
    node.metrics.frame_received("ball", 2.0)
    level, text, values = node.report(warnings=["x"], silent=silent)["/hpccd: frames"]
    assert level == DiagnosticStatus.WARN and text == f"x; {silent[0]}"
    assert (values["warning.1"], values["warning.2"]) == ("x", silent[0])


def test_one_and_many():
    node = Fixture()
    node.accounts.rejected(Rejection("cloth", Reason.OVERLOAD))
    assert node.report()["/hpccd: frames"][1] == "1 frame dropped (overload 1)"
    assert node.report(errors=(1, "x"))["/hpccd: errors"][1] == "1 unexpected error, the last: x"


def test_coordinate_frame_is_told():
    values = Fixture().report(coordinate_frame=("world", "a message of mesh cloth"))["/hpccd: frames"][2]
    assert (values["frame_id"], values["frame_id_by"]) == ("world", "a message of mesh cloth")


def test_percentiles():
    assert percentiles([]) == {}
    assert percentiles(list(range(101))) == {"p50": "50.00", "p95": "95.00", "p99": "99.00", "max": "100.00"}


def markers(n, n_vf, limit, near=False):
    points, normals = np.arange(3.0 * n).reshape(n, 3), np.tile([0.0, 0.0, 1.0], (n, 1))
    closest = np.stack([points, points + 0.5], axis=1) if near else np.empty((0, 2, 3))
    how = {"stamp": Time(sec=1), "frame_id": "world", "size": 0.1, "limit": limit}
    out = contact_markers(points, normals, closest, n_vf, **how).markers
    assert [m.ns for m in out] == ["vertex_face", "edge_edge", "normals", "near"]
    assert len({(m.ns, m.id) for m in out}) == 4 and all(m.header.frame_id == "world" for m in out)
    return out


def test_markers_hold_every_contact():
    vertex_face, edge_edge, normals, near = markers(5, 2, 100)
    assert [(p.x, p.y, p.z) for p in vertex_face.points] == [(0, 1, 2), (3, 4, 5)]
    assert len(edge_edge.points) == 3 and len(normals.points) == 10
    assert normals.points[1].z - normals.points[0].z == 1.0
    assert near.action == Marker.DELETE, "nothing is to stay apart"


def test_a_line_joins_the_sides_of_a_near_pair():
    near = markers(5, 2, 100, near=True)[3]
    assert near.action == Marker.ADD and near.type == Marker.LINE_LIST
    assert [(p.x, p.y, p.z) for p in near.points[2:4]] == [(3, 4, 5), (3.5, 4.5, 5.5)] and len(near.points) == 10
    assert len(markers(1000, 500, 100, near=True)[3].points) == 200


def test_markers_are_thinned_out_evenly():
    vertex_face, edge_edge, *_ = markers(1000, 500, 100)
    assert len(vertex_face.points) == len(edge_edge.points) == 50


def test_no_contacts_delete_the_markers():
    assert all(m.action == Marker.DELETE for m in markers(0, 0, 10))
