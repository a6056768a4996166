"""Read a whole recording and account for every message and every byte."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import msgspec
import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.recordings.camera.images import ImageLayout, is_picture
from calib_core.recordings.camera.picture_checks import PictureCheck
from calib_core.recordings.containers.accounts import Progress
from calib_core.recordings.containers.sources import Channel, Source
from calib_core.recordings.messages.decoding import decode
from calib_core.recordings.messages.definitions import Definition, definition_of
from calib_core.recordings.recording import Recording
from calib_core.results import DataWarning

_LOSSES = frozenset({
    "checksum", "damaged-file", "definitions-damaged", "file-left-out", "messages-missing", "missing-file", "not-closed",
    "packed-file-damaged",
})  # fmt: skip
_PROGRESS_MESSAGES = 200
_WORD = re.compile(r"\w+", re.ASCII)
_UNDESCRIBED = "(topics that the file does not describe)"


@dataclass(frozen=True, slots=True)
class FileCheck:
    """One file.

    Attributes:
        name: of the file or folder.
        size_bytes: its size; of a compressed file, once decompressed.
        container: its format.
        bytes_by: number of bytes by what they belong to; the sum is the size.
        faults: the first faults found.
    """

    name: str
    size_bytes: int
    container: str
    bytes_by: Mapping[str, int]
    faults: tuple[str, ...] = ()


@dataclass(slots=True)
class TopicCheck:
    """The messages of one topic, in all files.

    Attributes:
        topic: its name.
        type: of its messages.
        read: number of messages that are whole and fit their definition; of pictures, that can be decoded.
        unread: number of whole messages whose type is unknown or whose encoding is not supported.
        unindexed: number of messages in the file that its index does not name; they are not used.
        damaged: number of messages that are cut off, overwritten, or in a chunk with a wrong checksum.
        undecodable: number of messages that are there but do not fit their definition, or are no whole picture.
        fault: the first reason of all these; "" if there is none.
    """

    topic: str
    type: str = ""
    read: int = 0
    unread: int = 0
    unindexed: int = 0
    damaged: int = 0
    undecodable: int = 0
    fault: str = ""


class Verification(msgspec.Struct, frozen=True):
    """The result for a whole recording.

    Attributes:
        sound: nothing is damaged, lost, unindexed or undecodable.
        files: as opened.
        topics: by name.
        warnings: of opening and reading it.
    """

    sound: bool
    files: tuple[FileCheck, ...]
    topics: tuple[TopicCheck, ...]
    warnings: tuple[DataWarning, ...]


@dataclass(frozen=True, slots=True)
class _Reading:
    """How to read: the problems of topics that are not supported, whether to decode pictures, whom to tell."""

    problems: Mapping[str, str]
    decode_pictures: bool
    progress: Progress | None


@dataclass(slots=True)
class _Topics:
    """The topics counted so far."""

    found: dict[str, TopicCheck] = field(default_factory=dict)

    def of(self, name: str, kind: str) -> TopicCheck:
        return self.found.setdefault(name, TopicCheck(name, kind))


def verify_recording(
    recording: Recording, *, decode_pictures: bool = False, progress: Progress | None = None
) -> Verification:
    """Read every message of a recording and account for every byte of its files.

    Args:
        recording: open; it need not have a radar or a camera.
        decode_pictures: decode each picture instead of looking at its first and last bytes.
        progress: called with the amount done and the total, of each step.
    """
    topics = _Topics()
    problems = {one.name: one.problem for one in recording.topics if one.problem and one.problem != "no messages"}
    reading = _Reading(problems, decode_pictures, progress)
    files = tuple(_file(source, topics, reading) for source in recording.sources)
    warnings = recording.warnings
    checks = tuple(sorted(topics.found.values(), key=lambda one: one.topic))
    lost = any(one.unindexed or one.damaged or one.undecodable for one in checks)
    sound = not (lost or any(file.faults or file.bytes_by.get("damaged") for file in files))
    return Verification(sound and not any(warning.code in _LOSSES for warning in warnings), files, checks, warnings)


def _file(source: Source, topics: _Topics, reading: _Reading) -> FileCheck:
    """Check one file, and count its messages."""
    account = source.account(reading.progress)
    for channel in source.channels:
        check = topics.of(channel.topic, channel.type)
        check.unindexed += account.unindexed.get(channel.id, 0)
        check.damaged += account.skipped.get(channel.id, 0)
        _read_channel(source, channel, check, account.damaged.get(channel.id, 0), reading)
    known = {channel.id for channel in source.channels}
    unindexed, damaged = (
        sum(count for number, count in counted.items() if number not in known)
        for counted in (account.unindexed, account.damaged)
    )
    if unindexed or damaged:
        check = topics.of(_UNDESCRIBED, "")
        check.unindexed += unindexed
        check.damaged += damaged
    by_kind = {str(kind): count for kind, count in account.bytes_by.items()}
    return FileCheck(source.path.name, sum(by_kind.values()), source.container, by_kind, account.faults)


def _read_channel(source: Source, channel: Channel, check: TopicCheck, damaged: int, reading: _Reading) -> None:
    """Read all messages of a channel in the order of the file."""
    index = source.index(channel.id)
    reader = _Reader(channel, reading)
    broken = undecodable = 0
    for number, row in enumerate(np.lexsort((index.offset, index.chunk)).tolist()):
        if reading.progress is not None and number % _PROGRESS_MESSAGES == 0:
            reading.progress(number, len(index))
        try:
            payload = source.read(int(index.chunk[row]), int(index.offset[row]))
        except RecordingError as error:
            broken += 1
            check.fault = check.fault or str(error)
            continue
        try:
            reader.read(payload)
        except MessageError as error:
            undecodable += 1
            check.fault = check.fault or str(error)
    cut, why = reader.cut_off()
    check.fault = check.fault or why or reader.problem
    broken = max(broken, damaged)
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
        reading: how to read.
    """

    def __init__(self, channel: Channel, reading: _Reading) -> None:
        self.problem = reading.problems.get(channel.topic, "")
        self.misfit = ""
        self._definition: Definition | None = None
        self._pictures: PictureCheck | None = None
        try:
            self._definition = definition_of(channel)
        except MessageError as error:
            if _is_stated(channel):
                self.misfit = str(error)
            else:
                self.problem = str(error)
            return
        if is_picture(self._definition) and not self.problem:
            self._pictures = PictureCheck(ImageLayout(self._definition, channel.topic), reading.decode_pictures)

    def read(self, payload: bytes) -> None:
        """Decode one message.

        Raises:
            MessageError: it does not fit its definition, or is no whole picture.
        """
        if self.misfit:
            raise MessageError(self.misfit)
        if self._definition is not None:
            decode(self._definition, payload)
        if self._pictures is not None:
            self._pictures.check(payload)

    def cut_off(self) -> tuple[int, str]:
        """Return how many pictures are cut off, and why."""
        return (0, "") if self._pictures is None else self._pictures.cut_off()
