"""Read a whole recording, and say what is damaged, lost or undecodable: `cocalib info --verify`."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import msgspec
import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.recordings.camera.images import ImageLayout, is_image
from calib_core.recordings.camera.jpeg import JPEG_MAGIC, PNG_MAGIC, has_end, png_fault
from calib_core.recordings.containers.chunks import ChunkedSource
from calib_core.recordings.containers.sources import Channel, Progress, Source
from calib_core.recordings.messages.decoding import decode
from calib_core.recordings.messages.definitions import Definition, definition_of
from calib_core.recordings.messages.foxglove import ros_message
from calib_core.recordings.plain_files.source import PlainSource
from calib_core.recordings.recording import LOSSES, Recording
from calib_core.recordings.summary import FileSummary, files_of, table_lines
from calib_core.words.outcomes import WarningText, warning_text

_PROGRESS_MESSAGES = 200


_WORD = re.compile(r"\w+", re.ASCII)


_COUNTS = ("read", "unread", "damaged", "undecodable")


_CUT = "the JPEG has no end marker: it is cut off"


@dataclass(slots=True)
class TopicCheck:
    """The messages of one topic, in all files.

    Attributes:
        topic: its name.
        type: of its messages.
        read: number of messages that are whole and fit their definition; of images, whole.
        unread: number of whole messages whose type is unknown or whose encoding is not supported.
        damaged: number of messages that are cut off, overwritten, or in a chunk with a wrong checksum.
        undecodable: number of messages that are there but do not fit their definition, or are no whole image.
        fault: the first reason of all these; "" if there is none.
    """

    topic: str
    type: str = ""
    read: int = 0
    unread: int = 0
    damaged: int = 0
    undecodable: int = 0
    fault: str = ""


class Verification(msgspec.Struct, frozen=True):
    """The result for a whole recording.

    Attributes:
        sound: nothing is damaged, lost or undecodable.
        files: as opened.
        topics: by name.
        warnings: of opening and reading it.
    """

    sound: bool
    files: tuple[FileSummary, ...]
    topics: tuple[TopicCheck, ...]
    warnings: tuple[WarningText, ...]


@dataclass(slots=True)
class _Topics:
    """The topics counted so far."""

    found: dict[str, TopicCheck] = field(default_factory=dict)

    def of(self, name: str, kind: str) -> TopicCheck:
        return self.found.setdefault(name, TopicCheck(name, kind))


def verify_recording(recording: Recording, *, progress: Progress | None = None) -> Verification:
    """Read every message of a recording, and check every checksum; of images the first and the last bytes are looked at.

    Args:
        recording: open; it need not have a radar or a camera.
        progress: called with the amount done and the total, of each step.
    """
    topics = _Topics()
    problems = {
        topic.name: topic.problem for topic in recording.topics if topic.problem and topic.problem != "no messages"
    }
    for source in recording.sources:
        _read_source(source, topics, problems, progress)
    warnings = recording.warnings
    checks = tuple(sorted(topics.found.values(), key=lambda value: value.topic))
    lost = any(check.damaged or check.undecodable for check in checks)
    sound = not lost and not any(warning.code in LOSSES for warning in warnings)
    return Verification(sound, files_of(recording), checks, tuple(map(warning_text, warnings)))


def _read_source(source: Source, topics: _Topics, problems: Mapping[str, str], progress: Progress | None) -> None:
    """Read one file, and count its messages."""
    if isinstance(source, ChunkedSource):
        source.check_stored_chunks(progress)
    for channel in source.channels:
        check = topics.of(channel.topic, channel.type)
        if isinstance(source, PlainSource) and source.unreadable:
            check.damaged += len(source.unreadable)
            check.fault = check.fault or " ".join(map(str, next(iter(source.unreadable.items()))))
        _read_channel(source, channel, check, problems.get(channel.topic, ""), progress)


def _read_channel(source: Source, channel: Channel, check: TopicCheck, problem: str, progress: Progress | None) -> None:
    """Read all messages of a channel in the order of the file."""
    index = source.index(channel.id)
    reader = _Reader(channel, problem)
    broken = undecodable = 0
    for number, row in enumerate(np.lexsort((index.offset, index.chunk)).tolist()):
        if progress is not None and number % _PROGRESS_MESSAGES == 0:
            progress(number, len(index))
        try:
            payload = source.read(int(index.chunk[row]), int(index.offset[row]))
        except RecordingError as error:
            broken += 1
            check.fault = check.fault or str(error)
            continue
        try:
            reader.read(ros_message(channel, payload))
        except MessageError as error:
            undecodable += 1
            check.fault = check.fault or str(error)
    cut, why = reader.cut_off()
    check.fault = check.fault or why or reader.problem
    if isinstance(source, ChunkedSource):
        broken = max(broken, source.wrong_checksums(channel.id))
    undecodable = min(undecodable + cut, len(index) - broken)
    whole = len(index) - broken - undecodable
    check.damaged += broken
    check.undecodable += undecodable
    check.unread += whole if reader.problem else 0
    check.read += 0 if reader.problem else whole


def _is_stated(channel: Channel) -> bool:
    """Return whether a file states how to decode a channel, or states nonsense: both are its damage if that fails."""
    if channel.encoding not in ("ros1", "cdr"):
        return not _WORD.fullmatch(channel.encoding)
    return bool(channel.definition) or not _WORD.fullmatch(channel.type.replace("/", ""))


class _Reader:
    """Decodes the messages of one channel.

    Args:
        channel: the channel.
        problem: why its messages are not supported; "" if they are.
    """

    def __init__(self, channel: Channel, problem: str) -> None:
        self.problem = problem
        self.misfit = ""
        self._definition: Definition | None = None
        self._images: ImageCheck | None = None
        try:
            self._definition = definition_of(channel)
        except MessageError as error:
            if _is_stated(channel):
                self.misfit = str(error)
            else:
                self.problem = str(error)
            return
        if is_image(self._definition) and not self.problem:
            self._images = ImageCheck(ImageLayout(self._definition, channel.topic))

    def read(self, payload: bytes) -> None:
        """Decode one message.

        Raises:
            MessageError: it does not fit its definition, or is no whole image.
        """
        if self.misfit:
            raise MessageError(self.misfit)
        if self._definition is not None:
            decode(self._definition, payload)
        if self._images is not None:
            self._images.check(payload)

    def cut_off(self) -> tuple[int, str]:
        """Return how many images are cut off, and why."""
        return (0, "") if self._images is None else self._images.cut_off()


@dataclass(slots=True)
class ImageCheck:
    """Checks the images of one topic, one after the other.

    Attributes:
        layout: of the topic's messages.
        open_ended: number of images without an end marker, which some drivers never write.
        images: number of images checked.
    """

    layout: ImageLayout
    open_ended: int = 0
    images: int = 0

    def check(self, payload: bytes) -> None:
        """Check one message.

        Raises:
            MessageError: it contains no image, or a damaged one.
        """
        self.images += 1
        if self.layout.packet(payload) is not None:
            return
        self.layout.size_px(payload)
        start = payload.find(JPEG_MAGIC) if self.layout.compressed else -1
        if start >= 0 and not has_end(payload[start:]):
            self.open_ended += 1
        start = payload.find(PNG_MAGIC) if self.layout.compressed else -1
        if start >= 0 and (fault := png_fault(payload[start:])):
            raise MessageError(f"topic {self.layout.topic}: an image {fault}")

    def cut_off(self) -> tuple[int, str]:
        """Return how many images are cut off, and why; none if the driver writes no end markers at all."""
        habit = self.open_ended > self.images / 2
        return (0, "") if habit or not self.open_ended else (self.open_ended, _CUT)


def verification_text(verification: Verification) -> str:
    """Format a verification as text: files, messages by topic, the result last."""
    rows = [("topic", *_COUNTS), *((topic.topic, *map(str, _counts(topic))) for topic in verification.topics)]
    lines = [f"file      {file.name}, {file.size_bytes} bytes, {file.container}" for file in verification.files]
    lines += [
        "",
        *table_lines(rows, right=range(1, 1 + len(_COUNTS))),
        *(f"  {one.topic}: {one.fault}" for one in verification.topics if one.fault),
        "",
    ]
    for warning in verification.warnings:
        lines.append(f"warning   {warning.message}. [{warning.code}]")
    lines.append(f"result    {_result(verification)}")
    return "\n".join(line.rstrip() for line in lines)


def _counts(check: TopicCheck) -> tuple[int, ...]:
    return check.read, check.unread, check.damaged, check.undecodable


def _result(verification: Verification) -> str:
    if verification.sound:
        return "sound: everything was read, and nothing is damaged or lost"
    sums = [sum(column) for column in zip(*map(_counts, verification.topics), strict=True)] or [0] * len(_COUNTS)
    named = [
        f"{count} messages {name}" for name, count in zip(_COUNTS, sums, strict=True) if count and name in _COUNTS[2:]
    ]
    return f"not sound: {', '.join(named) or 'see above'}; everything else is read"
