# SPDX-License-Identifier: Apache-2.0
"""A page in a headless Chromium, controlled over a pipe by the DevTools protocol, without a driver."""

import base64
import functools
import io
import json
import os
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# WebGL by the processor, no connections of its own.
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--remote-debugging-pipe",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--force-device-scale-factor=1",
    "--hide-scrollbars",
)
# The protocol uses descriptors 3 and 4; the pipes may already have these numbers, in the other order.
EXECUTE = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
for end, number in zip(ends, (3, 4)):
    os.dup2(end, number)
    os.close(end)
os.execv(sys.argv[3], sys.argv[3:])
"""


@functools.cache
def program() -> str | None:
    """Path of a Chromium that runs; HPCCD_CHROMIUM if it is set. (Ubuntu's package only prints how to install it.)"""
    if named := os.environ.get("HPCCD_CHROMIUM"):
        return named
    for path in filter(None, map(shutil.which, NAMES)):
        told = subprocess.run([path, "--version"], env=_environment(), capture_output=True, timeout=60)
        if told.returncode == 0:
            return path
    return None


def _environment():
    """The environment without the libraries of the ROS wheels, which differ from those of the system."""
    return {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}


class Chromium:
    """One tab of `size` pixels. said: what pages wrote to the console or threw; asked: addresses of all requests."""

    def __init__(self, folder, size=(1280, 800), options=()):
        to_browser, from_browser = os.pipe(), os.pipe()
        ends = (to_browser[0], from_browser[1])
        arguments = [
            program(),
            *OPTIONS,
            *options,
            f"--user-data-dir={folder}",
            f"--window-size={size[0]},{size[1]}",
            "about:blank",
        ]
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", "-c", EXECUTE, *map(str, ends), *arguments],
            pass_fds=ends,
            env=_environment(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for end in ends:
            os.close(end)
        self._write, self._read = to_browser[1], from_browser[0]
        self._buffer, self._number, self._session = b"", 0, None
        self.said: list[str] = []
        self.asked: list[str] = []
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(f"{domain}.enable")
        screen = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self._call("Emulation.setDeviceMetricsOverride", **screen)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(30)
        os.close(self._write)
        os.close(self._read)

    def open(self, path: Path) -> None:
        self._call("Page.navigate", url=Path(path).resolve().as_uri())

    def evaluate(self, expression: str):
        """The value of an expression of JavaScript; a promise's when it is settled."""
        result = self._call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def wait(self, expression: str, timeout=120.0):
        """Wait until `expression` is true; its value."""
        end = time.monotonic() + timeout
        while not (value := self.evaluate(expression)):
            assert time.monotonic() < end, f"{expression} was not true within {timeout} s; console: {self.said}"
            time.sleep(0.05)
        return value

    def press(self, key: str, code: int = 0) -> None:
        text = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self._call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, **text)

    def move(self, x: float, y: float) -> None:
        self._call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def drag(self, start, end) -> None:
        """With the left button."""
        for kind, (x, y) in (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end)):
            self._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def picture(self, path=None) -> np.ndarray:
        """(height, width, 3) of the tab, once all that was asked for is drawn."""
        self.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
        data = base64.b64decode(self._call("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            Path(path).write_bytes(data)
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)

    def _call(self, method: str, **parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._write, data) :]
        while True:
            response = self._receive()
            if response.get("id") == self._number:
                assert "error" not in response, response
                return response["result"]
            self._note(response)

    def _receive(self, timeout=120.0):
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._read], [], [], timeout)
            assert ready, f"Chromium said nothing for {timeout} s"
            data = os.read(self._read, 1 << 20)
            assert data, f"Chromium has ended with status {self._process.wait(30)}"
            self._buffer += data
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def _note(self, event):
        details = event.get("params", {})
        match event.get("method"):
            case "Runtime.consoleAPICalled":
                self.said.append(" ".join(str(part.get("value", part.get("description"))) for part in details["args"]))
            case "Runtime.exceptionThrown":
                self.said.append(json.dumps(details["exceptionDetails"]))
            case "Log.entryAdded":
                self.said.append(details["entry"]["text"])
            case "Network.requestWillBeSent":
                self.asked.append(details["request"]["url"])
