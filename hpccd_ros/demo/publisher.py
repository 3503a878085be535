# SPDX-License-Identifier: Apache-2.0
"""The demo's publisher: plays a scene like `hpccd scene --publish`, but waits for node and recorder.

`python -m hpccd_ros.demo.publisher SCENE SIZE FRAMES RATE`
"""

import sys

from hpccd_ros import scenes
from hpccd_ros.scenes.publish import publish

# s; reached only where a process hangs.
PATIENCE = 120.0


def main(name: str, size: float, frames: int, rate: float) -> int:
    count = publish(scenes.make(name, size, frames), rate, wait=PATIENCE, subscribers=2, await_results=True)
    print(f"published {count} frames", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])))
