# SPDX-License-Identifier: Apache-2.0
"""Minutes or hours of mixed load on a node in a process of its own: streams of four meshes, one of them with sixteen
changes of topology in every run, one from a publisher that is ended or killed and started again; wrong messages of
ten kinds; a misspelt mesh; right and wrong requests to ~/detect. Every 25th answer (--check-every) is computed again.

  python -m bench soak                          forty minutes, about a tenth of the machine
  python -m bench soak --minutes 1 --rate 30 --memory-limit 10

In the warm-up the node is held up (SIGSTOP) until what waits for it is as much as it can be, in its queues and in the
shared memory of the publisher: what it takes for that counts as its own from then on, whenever it comes.

Fails where the node ends, an answer is wrong, a counter does not add up, or its resident memory changes by more than
--memory-limit between the beginning (after --warm-up) and the end.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from bench import lab
from hpccd_ros.base.errors import UserError


def configure(parser):
    what = parser.add_argument_group("what is done")
    what.add_argument("--minutes", type=float, default=40.0, metavar="M", help="(default: %(default)s)")
    what.add_argument("--rate", type=float, default=10.0, metavar="HZ", help="frames a second (default: %(default)s)")
    what.add_argument(
        "--restart-every",
        type=float,
        default=12.0,
        metavar="S",
        help="life of the publisher that is restarted, s, on average (default: %(default)s)",
    )
    what.add_argument(
        "--warm-up",
        type=float,
        default=0.25,
        metavar="X",
        help="share of the time before memory counts (default: %(default)s, ten of forty minutes)",
    )
    what.add_argument(
        "--memory-limit",
        type=float,
        default=1.0,
        metavar="PERCENT",
        help="largest change of resident memory (default: %(default)s)",
    )
    what.add_argument(
        "--check-every", type=int, default=25, metavar="N", help="compute every Nth answer again (default: %(default)s)"
    )
    what.add_argument("--seed", type=int, default=0, metavar="N", help="of what is random (default: %(default)s)")
    lab.configure(parser, leave_out=("data", "size", "threads", "repeat"))


def run(args) -> lab.Report:
    for name in ("minutes", "rate", "restart_every", "memory_limit", "check_every"):
        if not getattr(args, name) > 0:
            raise UserError(f"--{name.replace('_', '-')} {getattr(args, name)}: must be above 0")
    if not 0 <= args.warm_up < 0.8:
        raise UserError(f"--warm-up {args.warm_up}: a share of the time, from 0 to below 0.8")
    # A domain of its own, unless the user names one: strangers' meshes would be counted too.
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    # Imported here: ROS reads the domain when it is first used, and `python -m bench --help` needs no ROS.
    from bench.ros.soak import accounts
    from bench.ros.soak.session import Session

    report = lab.begin(args)[0]
    with tempfile.TemporaryDirectory(prefix="hpccd-soak-") as folder:
        session = Session(args, report, Path(folder))
        session.run()
        accounts.check(session)
        accounts.show(session)
    return report
