"""Recognise radar layouts by a message's fields, never by the name of its package."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

from calib_core.errors import MessageError
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.radar.array_messages import ArrayLayout
from calib_core.recordings.radar.list_messages import ListLayout, PointLayout
from calib_core.recordings.radar.point_clouds import ChannelCloudLayout, CloudLayout, is_channel_cloud, is_cloud

__all__ = ["RadarLayout", "ScanLayout", "layouts_of_parts", "recognise"]


ScanLayout: TypeAlias = CloudLayout | ChannelCloudLayout | ListLayout | ArrayLayout
"""Every message is a whole scan."""

RadarLayout: TypeAlias = ScanLayout | PointLayout


def recognise(definition: Definition, payload: bytes) -> RadarLayout | None:
    """Return the reader of a message's layout, None if it is not a radar's.

    Raises:
        MessageError: its definition is a radar's, but the message is inconsistent.
    """
    if is_cloud(definition):
        return CloudLayout.recognise(definition, payload)
    if is_channel_cloud(definition):
        return ChannelCloudLayout.recognise(definition, payload)
    if definition.stamp_offset is None:
        return None
    return (
        ListLayout.recognise(definition)
        or ArrayLayout.recognise(definition)
        or PointLayout.recognise(definition, payload)
    )


def layouts_of_parts(first: RadarLayout, definitions: Sequence[Definition]) -> tuple[RadarLayout, ...]:
    """Return the reader for each file's part of a topic, given the reader for the first.

    Raises:
        MessageError: the files have different message layouts under one topic.
    """
    return tuple(_same_layout(first, definition) for definition in definitions)


def _same_layout(first: RadarLayout, definition: Definition) -> RadarLayout:
    same = definition.fields == first.definition.fields and definition.encoding == first.definition.encoding
    if same:
        return first
    if isinstance(first, CloudLayout) and is_cloud(definition):
        return replace(first, definition=definition, _known={})
    if isinstance(first, ChannelCloudLayout) and is_channel_cloud(definition):
        return replace(first, definition=definition)
    found = type(first).recognise(definition) if isinstance(first, ListLayout | ArrayLayout) else None
    if found is None:
        raise MessageError(
            f"the files have {first.definition.type} and {definition.type} messages with different layouts under one topic; "
            "open them one at a time"
        )
    return found.with_plan(found.plan.read_as(first.plan.axes)) if first.plan.axes else found
