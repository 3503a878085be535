# SPDX-License-Identifier: Apache-2.0
"""Publishes the results of a step: contacts; on request smallest distances, and summaries of pairs of meshes."""

from typing import Any

from hpccd.msg import ContactArray, DistanceArray, PairSummary, PairSummaryArray
from std_msgs.msg import Header

from hpccd_ros.detect.pair_summary import summarise
from hpccd_ros.detect.step_detector import Detection
from hpccd_ros.frames.taken_inputs import TakenInputs
from hpccd_ros.middleware import contact_messages, fields, qos, result_fields, snapshot_messages, topic_names
from hpccd_ros.node.life_cycle import GuardedLifecycleNode


class ContactsPublisher:
    """Publishers of a configured ``node``, until it is unconfigured."""

    def __init__(self, node: GuardedLifecycleNode, settings: dict[str, Any]) -> None:
        self._settings = settings
        profile = qos.contacts(settings["contacts_durability"])
        self._contacts = node.configured_publisher(ContactArray, topic_names.CONTACTS, profile)
        self._distances = node.configured_publisher(DistanceArray, topic_names.DISTANCES, qos.DISTANCES)
        self._pairs = node.configured_publisher(PairSummaryArray, topic_names.PAIRS, qos.PAIRS)

    @property
    def topic(self) -> str:
        return self._contacts.topic_name

    def publish(self, found: Detection, dropped_frames: int, taken: TakenInputs) -> ContactArray:
        """Returns the message sent. dropped_frames: of the scene, so far. taken: the inputs taken so far."""
        # check_fields: its arrays are taken as they are, not copied.
        message = ContactArray(
            step=found.end.step, accuracy=found.options.accuracy, backend=found.backend, check_fields=True
        )
        message.header.stamp = fields.ns_to_stamp(found.end.stamp)
        message.header.frame_id = found.end.frame_id
        message.start = fields.ns_to_stamp(found.start.stamp)
        contact_messages.fill_contacts(
            message,
            found.contacts,
            found.layout,
            max_contacts=self._settings["max_contacts"],
            outputs=tuple(self._settings["outputs"]),
        )
        result_fields.fill_separation(message, found.options.separation)
        result_fields.fill_thickness(message, found.options.thickness)
        result_fields.fill_rest(message, found.rest_stamps)
        result_fields.fill_features(message, found.options.features)
        result_fields.fill_bounds(message, found.bounds)
        message.dropped_frames = dropped_frames
        last = found.end.inputs
        result_fields.fill_inputs(message, taken.pop_until(last), start=found.start.inputs, end=last)
        result_fields.fill_report(message, found.options.report)
        self._contacts.publish(message)
        if found.gaps is not None:
            self._publish_distances(found, message.header)
        if self._settings["pair_summaries"] and self._pairs.get_subscription_count():
            self._publish_pairs(found, message.header)
        return message

    def _publish_distances(self, found: Detection, header: Header) -> None:
        message = DistanceArray(
            header=header, step=found.end.step, accuracy=found.options.accuracy, backend=found.gaps_backend
        )
        snapshot_messages.fill_distances(
            message,
            found.gaps,
            found.layout,
            before=found.gaps_before,
            approached=found.gaps_approached,
            seconds=1e-9 * (found.end.stamp - found.start.stamp),
        )
        result_fields.fill_thickness(message, found.options.thickness)
        self._distances.publish(message)

    def _publish_pairs(self, found: Detection, header: Header) -> None:
        pairs = [PairSummary(**vars(pair)) for pair in summarise(found)]
        self._pairs.publish(PairSummaryArray(header=header, step=found.end.step, pairs=pairs))
