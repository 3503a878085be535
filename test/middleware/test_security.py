# SPDX-License-Identifier: Apache-2.0
"""Security: the shipped policy covers what the node does; where security is required but not available, none runs."""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from node_process import PATIENCE

FOLDER = Path(__file__).resolve().parents[2] / "config" / "security"
ENCLAVE = "/hpccd"


def policy_names():
    """The topics that policy.xml allows, in the names of DDS: (published, subscribed), as sros2 translates it."""
    published, subscribed = {"ros_discovery_info"}, {"ros_discovery_info"}
    for group in ElementTree.parse(FOLDER / "policy.xml").find(".//profile"):
        for entry in group:
            name = entry.text.replace("~", ENCLAVE) if entry.text[0] == "~" else entry.text
            name = name if name[0] == "/" else f"/{name}"
            if group.tag == "actions":
                for kind in ("cancel_goal", "get_result", "send_goal"):
                    published.add(f"rr{name}/_action/{kind}Reply")
                    subscribed.add(f"rq{name}/_action/{kind}Request")
                published |= {f"rt{name}/_action/{kind}" for kind in ("feedback", "status")}
            elif group.tag == "services":
                published.add(f"rr{name}Reply")
                subscribed.add(f"rq{name}Request")
            else:
                (published if "publish" in group.attrib else subscribed).add(f"rt{name}")
    return published, subscribed


def test_permissions_say_what_the_policy_says():
    rule = ElementTree.parse(FOLDER / "permissions.xml").find(".//allow_rule")
    said = tuple({topic.text for topic in rule.iterfind(f"{kind}/topics/topic")} for kind in ("publish", "subscribe"))
    assert said == policy_names()


def test_governance_lets_in_nobody_without_a_certificate():
    rule = ElementTree.parse(FOLDER / "governance.xml").find(".//domain_rule")
    values = {element.tag: element.text for element in rule.iter()}
    assert values["allow_unauthenticated_participants"] == "false"
    assert values["enable_join_access_control"] == "true"
    assert {kind: text for kind, text in values.items() if kind.endswith("_kind")}.keys() >= {"data_protection_kind"}
    assert all(text == "ENCRYPT" for kind, text in values.items() if kind.endswith("_kind"))


def test_the_policy_allows_all_that_the_node_does(start_node):
    node = start_node(
        {
            "meshes": ["cloth", "net"],
            "frame_id": "world",
            "markers": True,
            "use_sim_time": True,
            "service_introspection": "metadata",
            "mesh": {"net": {"input": "points", "transform": "tf"}},
        }
    )
    peer = node.peer.node
    surely_published = {"rt/contacts", "rt/markers", "rr/hpccd/detectReply", "rt/hpccd/detect/_service_event"}
    surely_published |= {"rt/hpccd/detect/_action/feedback"}
    surely_subscribed = {"rt/meshes/net/points", "rt/clock", "rt/transforms"}

    def endpoints():
        published, subscribed = set(), set()
        for topic, _ in peer.get_topic_names_and_types(no_demangle=True):
            for infos, names in (
                (peer.get_publishers_info_by_topic(topic, no_mangle=True), published),
                (peer.get_subscriptions_info_by_topic(topic, no_mangle=True), subscribed),
            ):
                if any(i.node_name == "hpccd" and i.node_namespace == node.namespace for i in infos):
                    names.add(topic.replace(node.namespace, ""))
        # Endpoints are discovered one by one, in any order.
        return (published, subscribed) if surely_published <= published and surely_subscribed <= subscribed else None

    published, subscribed = node.wait_until(endpoints, "endpoints of the node")
    for names, allowed in zip((published, subscribed), policy_names(), strict=True):
        assert len(names) > 5
        for name in names:
            assert any(re.fullmatch(rule.replace("*", "[^/]+"), name) for rule in allowed), name


def openssl(*arguments):
    subprocess.run(["openssl", *map(str, arguments)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def keystore(tmp_path_factory):
    """A whole keystore with the shipped governance and permissions, as `ros2 security` lays it out."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed: no keystore can be made")
    root = tmp_path_factory.mktemp("keystore")
    enclave = root / "enclaves" / ENCLAVE[1:]
    enclave.mkdir(parents=True)
    authority, authority_key = root / "ca.cert.pem", root / "ca.key.pem"
    for key in (authority_key, enclave / "key.pem"):
        openssl("ecparam", "-name", "prime256v1", "-genkey", "-noout", "-out", key)
    openssl("req", "-x509", "-new", "-key", authority_key, "-days", 30, "-subj", "/CN=testCA", "-out", authority)
    request = root / "request.pem"
    openssl("req", "-new", "-key", enclave / "key.pem", "-subj", f"/CN=\\{ENCLAVE}", "-out", request)
    signed = ("-CA", authority, "-CAkey", authority_key, "-CAcreateserial", "-days", 30)
    openssl("x509", "-req", "-in", request, *signed, "-out", enclave / "cert.pem")
    for name in ("identity_ca.cert.pem", "permissions_ca.cert.pem"):
        shutil.copy(authority, enclave / name)
    for name in ("governance", "permissions"):
        files = ("-in", FOLDER / f"{name}.xml", "-out", enclave / f"{name}.p7s")
        openssl("smime", "-sign", "-text", "-signer", authority, "-inkey", authority_key, *files)
    return root


def run_secured(strategy, keystore, *arguments):
    """(exit status, output) of a program for which DDS security is demanded."""
    demanded = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": strategy, "ROS_SECURITY_KEYSTORE": keystore}
    ended = subprocess.run(
        [sys.executable, "-m", *arguments],
        env={**os.environ, **demanded},
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=PATIENCE,
    )
    return ended.returncode, ended.stdout


def from_wheels():
    try:
        return bool(importlib.metadata.distribution("ros-fastrtps"))
    except importlib.metadata.PackageNotFoundError:
        return False


@pytest.mark.skipif(not from_wheels(), reason="this Fast DDS is not that of the wheels: it may have security plugins")
@pytest.mark.parametrize("strategy", ["Enforce", "Permissive"])
def test_without_security_plugins_no_node_runs(keystore, strategy):
    status, output = run_secured(strategy, str(keystore), "hpccd_ros.node", "--ros-args", "--enclave", ENCLAVE)
    assert status == 3, output
    assert "Found security directory" in output, "the keystore is whole: only the plugins are missing"
    assert "not available, so nothing is started" in output and "built without security" in output
    assert "Traceback" not in output


@pytest.mark.parametrize("module", [("hpccd_ros.node",), ("hpccd_ros.cli", "scene", "two-triangles", "--publish")])
def test_without_keys_nothing_runs(tmp_path, module):
    status, output = run_secured("Enforce", str(tmp_path / "nowhere"), *module)
    assert status == (3 if module[0].endswith("node") else 2), output
    assert "ROS_SECURITY_KEYSTORE" in output and "Traceback" not in output
