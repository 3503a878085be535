# SPDX-License-Identifier: Apache-2.0
"""The inputs that a node had taken for an answer <-> the fields of ContactArray that list them."""

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hpccd.msg import ContactArray

from hpccd_core.options import REPORTS
from hpccd_ros.frames.taken_inputs import TakenInput


@dataclass(frozen=True, eq=False)
class ListedInputs:
    """Iterate over the inputs that an answer lists: they are numbered without gaps, after ``before`` others.

    ``start``, ``end``: inputs taken when the frame at the start of the step, and that at its end, was complete.
    """

    before: int
    start: int
    topics: Sequence[str]
    topic: Sequence[int]
    sent: Sequence[int]
    flags: Sequence[int]

    @property
    def end(self) -> int:
        return self.before + len(self.sent)

    def __iter__(self) -> Iterator[TakenInput]:
        rows = zip(self.topic, self.sent, self.flags, strict=True)
        for number, (topic, sent, flags) in enumerate(rows, start=self.before + 1):
            yield TakenInput(number, self.topics[topic], sent, flags)


def fill_inputs(message: ContactArray, taken: Sequence[TakenInput], start: int, end: int) -> None:
    """taken: the last inputs, up to the number ``end``. start, end: inputs taken when the frame at the start of the
    step, and that at its end, was complete."""
    index: dict[str, int] = {}
    message.inputs_before, message.start_inputs = end - len(taken), start
    message.input_topic = array("H", [index.setdefault(one.topic, len(index)) for one in taken])
    message.input_topics = list(index)
    message.input_sent = array("q", [one.sent for one in taken])
    message.input_flags = array("B", [one.flags for one in taken])


def read_inputs(message: ContactArray) -> ListedInputs | None:
    """The inputs that an answer lists; None: its node lists none. Raises ValueError if fields conflict."""
    before, topics, sent = message.inputs_before, message.input_topics, message.input_sent
    if not (before or message.start_inputs or len(message.input_topic) or len(sent) or len(message.input_flags)):
        return None
    if not len(message.input_topic) == len(sent) == len(message.input_flags):
        raise ValueError(
            f"it lists {len(message.input_topic)} topics, {len(sent)} times and {len(message.input_flags)} flags of "
            "inputs"
        )
    if len(sent) and max(message.input_topic) >= len(topics):
        raise ValueError(f"an input is of topic {max(message.input_topic)}, and {len(topics)} are named")
    if message.start_inputs > before + len(sent):
        raise ValueError(f"its step began after {message.start_inputs} inputs and ended after {before + len(sent)}")
    return ListedInputs(before, message.start_inputs, topics, message.input_topic, sent, message.input_flags)


def fill_report(message: ContactArray, report: str) -> None:
    """Write the option ``report`` into ``message``."""
    message.report = 1 + REPORTS.index(report)


def read_report(message: ContactArray) -> str | None:
    """The option ``report`` of the answer; None: unknown."""
    return REPORTS[message.report - 1] if 0 < message.report <= len(REPORTS) else None
