# SPDX-License-Identifier: Apache-2.0
"""The content of an HTML page of a recording, read without the code that wrote it."""

import base64
import itertools
import json
import zlib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np


class Page(HTMLParser):
    """said: its JSON; scripts: text of those that run; texts: of all script elements with an id; tags: all elements,
    as (name, attributes)."""

    def __init__(self, path):
        super().__init__()
        self.text = Path(path).read_text(encoding="utf-8")
        self.scripts, self.texts, self.tags = [], {}, []
        self._open = None
        self.feed(self.text)
        self.close()
        self.said = json.loads(self.texts["content"])

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "script":
            self._open = dict(attrs)

    def handle_data(self, data):
        if self._open is None:
            return
        if "id" in self._open:
            self.texts[self._open["id"]] = self.texts.get(self._open["id"], "") + data
        else:
            self.scripts.append(data)

    def handle_endtag(self, tag):
        if tag == "script":
            self._open = None

    def integers(self, name, size, shape) -> np.ndarray:
        """The array of `shape` that `packed` wrote with integers of `size` bytes."""
        planes = np.frombuffer(zlib.decompress(base64.b64decode(self.texts[name])), np.uint8).reshape(size, -1)
        folded = sum(plane.astype(np.int64) << 8 * k for k, plane in enumerate(planes)).reshape(shape)
        differences = np.where(folded % 2, -(folded + 1) // 2, folded // 2)
        return differences.cumsum(axis=1).cumsum(axis=0) % (1 << 8 * size)

    def faces(self, mesh: int, step: int) -> np.ndarray:
        topology, number, _ = self._shown(mesh, step)
        return self.integers(f"mesh-{mesh}-faces-{number}", 4, (1, topology["faces"], 3))[0]

    def vertices(self, mesh: int, step: int) -> np.ndarray:
        topology, number, frame = self._shown(mesh, step)
        shape = (topology["frames"], topology["vertices"], 3)
        of_mesh = self.said["meshes"][mesh]
        rounded = self.integers(f"mesh-{mesh}-positions-{number}", 2, shape)[frame]
        return np.array(of_mesh["low"]) + of_mesh["step"] * rounded

    def _shown(self, mesh, step):
        number, frame = self.said["meshes"][mesh]["shown"][step]
        return self.said["meshes"][mesh]["topologies"][number], number, frame

    def curves(self, step: int) -> tuple[list[np.ndarray], np.ndarray]:
        """(the points (n,3) of each intersection curve of a step, start and end (D,2,3) of its depths)."""
        told, steps = self.said["curves"], self.said["steps"]
        points = self.integers("curves-points", 2, (1, told["count"], 3))[0] * told["step"] + told["low"]
        lengths = self.integers("curves-lengths", 4, (1, told["lines"], 1))[0, :, 0]
        before = sum(s["curves"][1] + 2 * len(s["depths"]) for s in steps[:step])
        first = sum(s["curves"][0] for s in steps[:step])
        ends = before + np.cumsum([0, *lengths[first : first + steps[step]["curves"][0]]])
        assert ends[-1] == before + steps[step]["curves"][1]
        lines = [points[a:b] for a, b in itertools.pairwise(ends)]
        return lines, points[ends[-1] : ends[-1] + 2 * len(steps[step]["depths"])].reshape(-1, 2, 3)

    def contacts(self, step: int) -> dict:
        """meshes (N,2), features (N,4), toc (N,), points (N,3) of a step, and how many are vertex-face."""
        told = self.said["contacts"]
        count = told["count"]
        drawn = [sum(s["drawn"]) for s in self.said["steps"]]
        of_step = slice(sum(drawn[:step]), sum(drawn[: step + 1]))
        points = self.integers("contacts-points", 2, (1, count, 3))[0]
        return {
            "vf": self.said["steps"][step]["drawn"][0],
            "meshes": self.integers("contacts-meshes", 4, (1, count, 2))[0][of_step],
            "features": self.integers("contacts-features", 4, (1, count, 4))[0][of_step],
            "toc": self.integers("contacts-toc", 2, (1, 1, count))[0, 0][of_step] / told["times"],
            "points": (np.array(told["low"]) + told["step"] * points)[of_step],
        }
