# SPDX-License-Identifier: Apache-2.0
"""Node, recorder and publisher as processes over DDS, in a namespace of their own."""

from pathlib import Path

from hpccd_ros import scenes
from hpccd_ros.bag.examine import examine
from hpccd_ros.scenes import files

# Long enough for an overloaded machine; only failing tests reach it.
PATIENCE = 240.0
# How long the processes wait for each other, s.
WAIT = str(PATIENCE)


class Live:
    """`children`: starts the processes. `scene`, `size`, `frames`: what is published."""

    def __init__(self, children, namespace, folder: Path, scene="cloth-drop", size=0.1, frames=30):
        self._children = children
        self._namespace = namespace
        self._remap = ("--ros-args", "-r", f"__ns:={namespace}")
        self._folder = folder
        self._scene = [scene, "--size", str(size), "--frames", str(frames)]
        self.parameters = folder / f"node{namespace[1:]}.yaml"
        files.write_parameters(scenes.make(scene, size=size, frames=frames), self.parameters)

    def node(self, *parameters: str):
        # Queues that hold the whole scene, so that a loaded machine drops nothing.
        parameters = ("frame_queue:=1000", "input_depth:=1000", *parameters)
        extra = [word for parameter in parameters for word in ("-p", parameter)]
        child = self._children.start(
            "node", "hpccd_ros.node", *self._remap, "--params-file", str(self.parameters), *extra
        )
        self._children.wait(lambda: child.has_printed("active: meshes"), "the node was not active", PATIENCE)
        return child

    def recorder(self, path, *options: str):
        name = f"recorder-{Path(path).name}"
        child = self._children.start(
            name,
            "hpccd_ros.cli",
            "record",
            "-o",
            str(path),
            "--node",
            f"{self._namespace}/hpccd",
            "--wait",
            WAIT,
            "--depth",
            "1000",
            *options,
        )
        self._children.wait(lambda: child.has_printed("recording "), "the recorder did not hear the node", PATIENCE)
        return child

    def publisher(self, *options: str, subscribers: int = 2):
        """Start publishing the scene; --loop and the like as options."""
        return self._children.start(
            "publisher",
            "hpccd_ros.cli",
            "scene",
            *self._scene,
            "--publish",
            "--rate",
            "40",
            "--subscribers",
            str(subscribers),
            "--wait",
            WAIT,
            *options,
            *self._remap,
        )

    def wait_for_results(self, path, count: int):
        """Wait until `count` contact messages are flushed to the recording `path`, a file or a folder of files.

        The publisher ends when its messages are acknowledged; the node may still compute the last results then.
        """
        files = lambda: sorted(path.glob("*.mcap")) if path.is_dir() else [path]  # noqa: E731
        recorded = lambda: sum(  # noqa: E731
            number for file in files() for topic, number in examine(file).counts.items() if topic.endswith("/contacts")
        )
        self._children.wait(lambda: recorded() >= count, f"{count} results were not recorded", PATIENCE)

    def play(self, path, *options: str):
        """Start publishing a recording, to a node and a recorder."""
        return self._children.start(
            "player", "hpccd_ros.cli", "replay", str(path), "--publish", "--subscribers", "2", "--wait", WAIT, *options
        )

    def kill(self, child):
        """SIGKILL; this end is not an error."""
        child.process.kill()
        child.process.wait()
        self._children.forget(child)

    def wait_for(self, child):
        """Wait until a process has ended without an error."""
        self._children.wait(lambda: not child.running, f"the {child.name} did not end", PATIENCE)
        self._children.check()

    def end(self, child) -> str:
        """End a process with SIGINT; returns its output. Fails if its exit status is not 0."""
        status = self._children.end(child)
        assert status == 0, f"{child.name} ended with {status}:\n{child.last_words()}"
        return child.last_words()
