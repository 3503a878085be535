# SPDX-License-Identifier: Apache-2.0
"""Shared code of the kinds of hostile recordings, and their names.

Each kind is a function of a random generator and a `Bag`, in which it changes one thing.
"""

import json

from bag_tools import typestore

KINDS = {}
NUMBERS = (0, 1, 2, 7, 255, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1)
LARGE = (0, 1, 8, 100, 2**31, 2**32, 2**40, 2**63 - 1, 2**63, 2**64 - 1)


def kind(function):
    KINDS[function.__name__] = function
    return function


def info_of(bag):
    return json.loads(bag.metadata[0].metadata["json"])


def set_info(bag, info):
    bag.metadata[0].metadata["json"] = json.dumps(info)


def decoded(bag, topic, rng, change, all_of_them=False):
    """Change messages of a topic as rosbags decodes them."""
    store = typestore()
    channel = bag.channel(topic)
    schema = next(schema for schema in bag.schemas if schema.id == channel.schema_id)
    messages = bag.of_topic(topic)
    for message in messages if all_of_them else [rng.choice(messages)]:
        thing = store.deserialize_cdr(message.data, schema.name)
        change(lambda name, value, thing=thing: object.__setattr__(thing, name, value), thing)
        message.data = bytes(store.serialize_cdr(thing, schema.name))


def topic_of(bag, *ends):
    return next(channel.topic for channel in bag.channels if channel.topic.endswith(ends))
