"""The registry of radar layouts: a message is recognised by its fields, never by its package's name."""

from typing import TypeAlias

from calib_core.recordings.definitions import Definition
from calib_core.recordings.radar_clouds import ChannelCloudLayout, CloudLayout, is_channel_cloud, is_cloud
from calib_core.recordings.radar_lists import ListLayout, PointLayout

__all__ = ["RadarLayout", "ScanLayout", "recognise"]


ScanLayout: TypeAlias = CloudLayout | ChannelCloudLayout | ListLayout
"""Every message is a whole scan."""

RadarLayout: TypeAlias = ScanLayout | PointLayout


def recognise(definition: Definition, payload: bytes) -> RadarLayout | None:
    """Return the reader of a message's layout, None where it is not a radar's.

    Raises:
        MessageError: it is one by its definition, but the message contradicts itself.
    """
    if is_cloud(definition):
        return CloudLayout.recognise(definition, payload)
    if is_channel_cloud(definition):
        return ChannelCloudLayout.recognise(definition, payload)
    if definition.stamp_offset is None:
        return None
    return ListLayout.recognise(definition) or PointLayout.recognise(definition, payload)
