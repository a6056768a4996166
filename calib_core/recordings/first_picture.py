"""The first picture of a recording, available before all stamps are read.

Finding the picture with the earliest stamp means reading all stamps, which takes a second or more for a large file on a
cold disk. A picture received near the beginning can be shown immediately. It has no time and cannot be clicked in.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from calib_core.errors import RecordingError
from calib_core.recordings.camera.images import EncodedImage, is_picture
from calib_core.recordings.camera.recorded_intrinsics import is_camera_info
from calib_core.recordings.containers.opening import open_beginnings
from calib_core.recordings.containers.sources import Channel, Source
from calib_core.recordings.messages.definitions import definition_of
from calib_core.recordings.selection import Inventory, RecordingOptions, Usage, select_image, usage_of
from calib_core.recordings.topics import Topic, join_topics


def first_picture(paths: Sequence[Path], options: RecordingOptions | None = None) -> EncodedImage | None:
    """Return a picture from the beginning of a recording, reading very little of it.

    It comes from the camera that opening the recording will most likely choose, and is not always the first frame of the
    timeline.

    Args:
        paths: as for open_recording.
        options: as for open_recording.

    Returns:
        None if the whole recording must be read first: it is damaged, compressed, a video, or not a recording.
    """
    options = options or RecordingOptions()
    try:
        for source in open_beginnings(paths, _is_picture):
            try:
                picture = _picture(source, options)
            finally:
                source.close()
            if picture is not None:
                return picture
    except (RecordingError, OSError):
        return None  # opening the recording reports what is wrong
    return None


def _is_picture(channel: Channel) -> bool:
    try:
        return is_picture(definition_of(channel))
    except RecordingError:
        return False


def _picture(source: Source, options: RecordingOptions) -> EncodedImage | None:
    topics, _ = join_topics((source,))
    inventory = Inventory(source.path.name, topics, {topic.name: _usage(topic) for topic in topics}, _counts(source))
    topic = select_image(inventory, options.image_topic if options.image_topic in inventory.usages else None)
    layout = inventory.usages[topic.name].image if topic is not None else None
    if topic is None or layout is None:
        return None
    payload = topic.payload(0)
    return None if layout.packet(payload) is not None else layout.encoded(payload)


def _usage(topic: Topic) -> Usage:
    """Inspect the messages of image topics; of other topics, only the declaration."""
    channel = topic.parts[0][1]
    if _is_picture(channel):
        return usage_of(topic)
    try:
        return Usage("camera-info" if is_camera_info(definition_of(channel)) else "other")
    except RecordingError:
        return Usage("other")


def _counts(source: Source) -> Mapping[str, int]:
    found: dict[str, int] = {}
    for channel in source.channels:
        found[channel.topic] = found.get(channel.topic, 0) + source.counts.get(channel.id, 0)
    return found
