"""The first picture of a recording, long before all of its stamps are read.

Which picture is first, the stamps in all messages say, and of a large file on a cold disk those take a second or more.
One that was received at the beginning can be shown at once. It has no time, so that nothing can be clicked in it.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from calib_core.errors import RecordingError
from calib_core.recordings.camera.camera_info import is_camera_info
from calib_core.recordings.camera.images import EncodedImage, is_picture
from calib_core.recordings.containers.opening import open_beginnings
from calib_core.recordings.containers.sources import Channel, Source
from calib_core.recordings.messages.definitions import definition_of
from calib_core.recordings.selection import Inventory, RecordingOptions, select_image
from calib_core.recordings.topics import Topic, join_topics
from calib_core.recordings.usages import Usage, usage_of

__all__ = ["first_picture"]


def first_picture(paths: Sequence[Path], options: RecordingOptions | None = None) -> EncodedImage | None:
    """Return a picture from the beginning of a recording, reading next to nothing of it.

    It is of the camera that opening the recording will most likely choose, and not always the frame that its timeline
    begins with.

    Args:
        paths: as for open_recording.
        options: likewise.

    Returns:
        None where the recording has to be read as a whole first: it is damaged, packed, a video, or no recording.
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
        return None  # opening the recording tells what is wrong
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
    """Look into the topics of pictures; of the others only into what they declare."""
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
