"""Recognize radar layouts by a message's fields, never by the name of its package."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.radar.column_plan import NOTHING_STATED, StatedReading
from calib_core.recordings.radar.message_layouts.list_messages import ArrayLayout, ListLayout, struct_lists
from calib_core.recordings.radar.message_layouts.point_clouds import (
    ChannelCloudLayout,
    CloudLayout,
    cloud_columns,
    is_channel_cloud,
    is_cloud,
)
from calib_core.recordings.radar.message_layouts.samples import Samples, leaf_names
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout

ScanLayout: TypeAlias = CloudLayout | ChannelCloudLayout | ListLayout | ArrayLayout
"""Every message is a whole scan."""

RadarLayout: TypeAlias = ScanLayout | PointLayout


def recognise(
    definition: Definition,
    payload: bytes,
    more: Callable[[int], Sequence[bytes]] | None = None,
    stated: StatedReading = NOTHING_STATED,
) -> RadarLayout | None:
    """Return the reader of a message's layout, None if it is not a radar's.

    Args:
        definition: of the topic's messages.
        payload: one of them.
        more: returns up to the given number of messages spread over the topic, to judge values.
        stated: what the user states about the messages.

    Raises:
        MessageError: its definition is a radar's, but the message is inconsistent, or it lacks a column that the user maps.
    """
    samples = Samples(definition, payload, more)
    with np.errstate(all="ignore"):  # damaged bytes may hold signalling NaN, and numbers whose squares overflow
        found = _recognise(samples, stated)
    if found is None and stated.column_map:
        stated.require(column_names(samples))
    return found


def _recognise(samples: Samples, stated: StatedReading) -> RadarLayout | None:
    definition = samples.definition
    if is_cloud(definition):
        return CloudLayout.recognise(samples, stated)
    if is_channel_cloud(definition):
        return ChannelCloudLayout.recognise(samples, stated)
    whole = ListLayout.recognise(definition, samples, stated) or ArrayLayout.recognise(definition, samples, stated)
    if whole is not None or definition.stamp_offset is None:
        return whole
    return PointLayout.recognise(definition, samples, stated)


def column_names(samples: Samples) -> list[str]:
    """Return the columns of a message that --map can name, as it spells them."""
    definition = samples.definition
    if is_cloud(definition):
        return cloud_columns(samples)
    lists = [
        f"{place.dotted}.{name}"
        for place in struct_lists(definition)
        for name in leaf_names(definition, place.element)[0]
    ]
    return [*lists, *leaf_names(definition, definition.type)[0], *leaf_names(definition, definition.type)[1]]


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
    is_alike = {CloudLayout: is_cloud, ChannelCloudLayout: is_channel_cloud}.get(type(first))
    if is_alike is not None and is_alike(definition):
        return replace(first, definition=definition)
    found = first.for_definition(definition) if isinstance(first, ListLayout | ArrayLayout) else None
    if found is None:
        raise MessageError(
            f"the files have {first.definition.type} and {definition.type} messages with different layouts under one topic; "
            "open them one at a time"
        )
    return found
