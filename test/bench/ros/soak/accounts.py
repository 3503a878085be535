# SPDX-License-Identifier: Apache-2.0
"""Whether a soak adds up: what was sent against what the node counted, its answers, its memory."""

from __future__ import annotations

from bench.ros.soak.restarted_publisher import MESH as RESTARTED
from bench.ros.soak.session import Session
from hpccd_ros.bench import report as tables
from hpccd_ros.frames.drops import Reason


def check(session: Session) -> None:
    """Each thing that does not add up becomes a failure of the report."""
    load, status, failure = session.load, session.status, session.report.failure
    if session.exit_status != 0:
        failure(f"the node ended with status {session.exit_status} at SIGINT: {session.last_words}")
    for text in load.wrong[:10]:
        failure(text)
    if not load.checked:
        failure("no answer was computed again: the time was too short to say anything of them")
    for mesh, missing in session.missing().items():
        if missing:
            failure(f"{mesh}: {missing} messages were sent, but neither received nor counted as lost")
    if status.unaccounted():
        failure(f"{status.unaccounted()} messages are not accounted for: {status.counts()}")
    _check_wrong_messages(load, status, failure)
    if _received_of_restarted(status) > session.sent_by_restarted:
        counted = _received_of_restarted(status)
        failure(f"{RESTARTED}: {counted} messages counted, {session.sent_by_restarted} sent")
    if status.count("failures", "detection"):
        failure(f"{status.count('failures', 'detection')} detections failed: {status.values['detection']}")
    text, change = _memory(session)
    session.report.note(f"resident memory of the node: {text}")
    if abs(change) > session.args.memory_limit:
        failure(f"resident memory changed by more than {session.args.memory_limit:g} %: {text}")


def _check_wrong_messages(load, status, failure) -> None:
    # Topics are not ordered among one another: a wrong message that the next topology overtakes is old as well. Of
    # one cut off, in a burst with right ones, only the gap in the numbers tells.
    known_otherwise = sum(
        status.count(f"dropped.{load.victim}.{reason}") for reason in (Reason.OLD_TOPOLOGY, Reason.MIDDLEWARE)
    )
    for reason, sent in load.wrong_messages.sent.items():
        counted = status.count(f"dropped.{load.victim}.{reason}")
        if counted > sent:
            failure(f"{sent} messages for {reason} were sent, the node counted {counted}")
        known_otherwise -= max(0, sent - counted)
    if known_otherwise < 0:
        failure(f"{-known_otherwise} wrong messages were not refused: {dict(load.wrong_messages.sent)}")
    for reason, sent in load.wrong_messages.topologies.items():
        counted = status.count(f"topologies_refused.{load.victim}.{reason}")
        if counted > sent:
            failure(f"{sent} topologies for {reason} were sent, the node refused {counted}")


def show(session: Session) -> None:
    """Print the accounts, and add them to the report as its last row."""
    args, load, status = session.args, session.load, session.status
    sent = sum(load.sent.values()) + session.sent_by_restarted
    wrong, topologies_wrong = load.wrong_messages.sent, load.wrong_messages.topologies
    not_received = session.sent_by_restarted - _received_of_restarted(status)
    tables.show(
        f"soak: {args.minutes:g} minutes at {args.rate:g} frames a second",
        ["what", "count"],
        [
            ["vertex messages sent", sent],
            *([f"  {name}", number] for name, number in status.counts().items()),
            ["  of the restarted publisher, not received around its ends", not_received],
            ["answers heard", load.answers],
            ["  cut to the earliest 5000", load.truncated],
            ["  computed again, equal", load.checked],
            ["changes of topology", load.topologies],
            ["wrong vertex messages, by kind as sent", sum(wrong.values())],
            ["wrong topologies", sum(topologies_wrong.values())],
            ["frames of a mesh unknown to the node", load.misspelt_sent],
            ["requests to ~/detect, all answered", load.requests],
            *([f"publisher {how} and started again", number] for how, number in session.ends.items()),
        ],
        caption=f"resident memory of the node: {_memory(session)[0]}",
    )
    session.report.add(
        second=round(60 * args.minutes),
        sent=sent,
        **status.counts(),
        answers=load.answers,
        checked=load.checked,
        topologies=load.topologies,
        requests=load.requests,
        replies=load.replies,
        **{f"publisher_{how}": number for how, number in session.ends.items()},
        wrong_sent={str(reason): n for reason, n in wrong.items()},
        topologies_wrong={str(reason): n for reason, n in topologies_wrong.items()},
        node_memory_mb=session.memory_mb(),
    )


def _received_of_restarted(status) -> int:
    return status.count(f"received.{RESTARTED}") + status.count(f"dropped.{RESTARTED}.middleware")


def _memory(session: Session) -> tuple[str, float]:
    """In words, and by how many percent it changed."""
    mb = session.memory_mb()
    change = 100 * (mb["last"] / mb["first"] - 1)
    text = f"{mb['first']:.1f} -> {mb['last']:.1f} MB ({change:+.2f} %), least {mb['least']:.1f}, most {mb['most']:.1f}"
    return text, change
