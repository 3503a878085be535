# SPDX-License-Identifier: Apache-2.0
"""Lost messages and new publishers from sequence numbers; the log of rejections."""

from hpccd_ros.frames.arrivals import InterleavedSequences, SequenceWatch
from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.node.accounts import RejectionLog


def test_gaps_are_losses():
    watch = SequenceWatch()
    assert [watch.next(n) for n in (4, 5, 8, 9)] == [(0, False), (0, False), (2, False), (0, False)]


def test_a_number_that_does_not_grow_is_a_new_publisher():
    watch = SequenceWatch()
    assert [watch.next(n) for n in (7, 1, 2, 2)] == [(0, False), (0, True), (0, False), (0, True)]


def test_a_publisher_that_came_is_no_loss():
    watch = SequenceWatch()
    watch.matched(total=1, new=1)
    assert watch.next(1) == (0, False), "the first publisher of all is not another one"
    watch.matched(total=2, new=1)
    assert watch.next(50) == (0, True)
    assert watch.before_first == 49
    watch.matched(total=2, new=0)
    assert watch.next(52) == (1, False), "a publisher that ended changes nothing"


def test_a_publisher_reported_after_its_first_message_hides_no_loss():
    watch = SequenceWatch()
    assert watch.next(1) == (0, False)
    watch.matched(total=1, new=1)
    assert watch.next(3) == (1, False)


def interleaved(*steps):
    """The losses that are found. steps: numbers read, "+" and "-" where a publisher is reported or its end."""
    sequences, publishers, found = InterleavedSequences(), 0, []
    for step in steps:
        if step in ("+", "-"):
            publishers += 1 if step == "+" else -1
            sequences.matched(new=step == "+", ended=step == "-")
        else:
            found.append(sequences.missing(step, alone=publishers <= 1))
    return found


def test_sequences_of_several_publishers():
    assert interleaved("+", 4, 5, 8) == [0, 0, 2]
    assert interleaved(1, "+", 3) == [0, 1], "reported after its first message"
    assert interleaved("+", 1, 2, "-", "+", 1, 2, 4) == [0, 0, 0, 0, 1]
    assert interleaved("+", 1, 2, "-", 1, "+", 3) == [0, 0, 0, 1], "not the next one of the publisher that ended"
    assert interleaved("+", 1, "+", 50, 2, 51, 3, "-", 52, 54) == [0, 0, 0, 0, 0, 0, 1]
    assert interleaved("+", 2, "-", "+", 7, 9) == [0, 0, 1], "the start of another publisher was overwritten"
    assert interleaved("+", "+", 1, 1, 2, 3, "-", 5) == [0, 0, 0, 0, 1]
    assert interleaved("+", "+", 1, "-", 3) == [0, 1], "the one that ended was never read"


def test_rejections_do_not_flood_the_log():
    now, lines = [0.0], []
    log = RejectionLog(lines.append, period=10.0, clock=lambda: now[0])
    for _ in range(5):
        log("cloth", Reason.NOT_FINITE, "vertex 3 is nan")
    log("cloth", Reason.LATE, "stamp 4")
    now[0] = 11.0
    log("cloth", Reason.NOT_FINITE, "vertex 4 is nan")
    assert lines == [
        "cloth: not_finite: vertex 3 is nan",
        "cloth: late: stamp 4",
        "cloth: not_finite: vertex 4 is nan (4 more of these in between)",
    ]
    assert log.last == "cloth: not_finite: vertex 4 is nan"


def test_what_is_rejected_of_many_links_of_a_robot_is_one_line():
    lines = []
    log = RejectionLog(lines.append)
    links = [Rejection(f"arm/l{k}", Reason.NO_TRANSFORM, f"no transform connects 'left_l{k}'") for k in range(30)]
    log.together([*links, Rejection("cloth", Reason.LATE, "stamp 4"), Rejection("arm/l1", Reason.RESTART), *links[:2]])
    log.together(links)
    first = "arm/l0: no_transform: no transform connects 'left_l0'; as well arm/l1, arm/l2, arm/l3, arm/l4, arm/l5, "
    assert lines == ["cloth: late: stamp 4", first + "arm/l6, arm/l7, arm/l8, arm/l9, arm/l10 and 19 more"]
