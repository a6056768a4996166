"""Definitions for channels that were stored without one, as in SQLite bags before ROS 2 Iron."""

from dataclasses import replace

from calib_core.recordings.containers.sources import StoredChannel
from calib_core.recordings.messages.definitions import short_type
from calib_core.recordings.messages.known_definitions import KNOWN_DEFINITIONS

_UNCHANGED = ("tf2_msgs/TFMessage",)


def with_definition(channel: StoredChannel) -> StoredChannel:
    """Return the channel with the well-known definition of its type, where it has none and there is one."""
    kind = short_type(channel.schema_name)
    if channel.schema_data.strip() or channel.encoding != "cdr" or kind not in (*KNOWN_DEFINITIONS, *_UNCHANGED):
        return channel
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    name = kind.replace("/", "/msg/")
    if name not in store.types:
        return channel
    definition, _ = store.generate_msgdef(name, ros_version=2)
    return replace(channel, schema_encoding="ros2msg", schema_data=definition.encode())
