# SPDX-License-Identifier: Apache-2.0
"""Make docs/performance.md and its pictures anew from the kept results: `python -m bench.report`, in the
folder of the checkout."""

import sys
from pathlib import Path

from bench.report import performance
from hpccd_ros.base.errors import UserError


def main() -> int:
    try:
        written = performance.write(Path("test/bench/results"), Path("docs"))
    except (UserError, OSError) as error:
        print(f"hpccd: {error}", file=sys.stderr)
        return 2
    print("wrote " + ", ".join(map(str, written)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
