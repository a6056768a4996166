"""Topics: channels with the same name joined across files, and the stamps of their messages."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, DataWarning, Stamp
from calib_core.recordings.containers.sources import Channel, Heads, MessageIndex, Source
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import Definition, definition_of
from calib_core.recordings.messages.foxglove import HEAD_BYTES, STAMP_BYTES, is_foxglove, ros_head, ros_message
from calib_core.recordings.time.clock_choice import Stamps
from calib_core.recordings.time.clock_diagnosis import ClockDiagnosis, between_islands

TopicKind = Literal["radar", "image", "camera-info", "other"]
BOX_LAYOUT = "boxes around objects"
"""How the layout of a topic with boxes begins."""


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """Summary of a topic; the attributes are the keys of `cocalib info --json`.

    Attributes:
        name: the topic.
        type: of its messages, as the recording spells it.
        count: number of messages.
        kind: what it can be used for.
        chosen: whether it is the radar, image or camera-info topic in use.
        rate_hz: messages per second, not counting long pauses; None with fewer than two.
        start: stamp of the first message by the topic's clock; None without messages.
        end: stamp of the last message.
        clock: the clock of start and end, "header" or "receive".
        longest_gap_s: longest time between consecutive messages [s]; None with fewer than two.
        jitter_s: median absolute deviation of that time from its median [s]; None with fewer than two.
        layout: short description of what is read from it; "" for kinds that need none.
        problem: why it cannot be used although its kind is right; None if there is no problem.
        clocks: what is known about its two clocks; None if its messages were not examined.
    """

    name: str
    type: str
    count: int
    kind: TopicKind
    chosen: bool
    rate_hz: float | None
    start: Stamp | None
    end: Stamp | None
    clock: Literal["header", "receive"]
    longest_gap_s: float | None
    jitter_s: float | None
    layout: str
    problem: str | None
    clocks: ClockDiagnosis | None = None

    @property
    def has_boxes(self) -> bool:
        """Whether it holds boxes around objects."""
        return self.layout.startswith(BOX_LAYOUT)


@dataclass(frozen=True, slots=True)
class Rhythm:
    """Rate and regularity of a series of stamps; all None with fewer than two.

    Attributes:
        rate_hz: stamps per second, not counting long pauses.
        longest_gap_s: longest time between consecutive stamps [s].
        jitter_s: median absolute deviation of that time from its median [s].
    """

    rate_hz: float | None = None
    longest_gap_s: float | None = None
    jitter_s: float | None = None

    @classmethod
    def of(cls, times_ns: TimesNs) -> "Rhythm":
        """Measure stamps in any order."""
        if len(times_ns) < 2:
            return cls()
        steps_s = np.diff(np.sort(times_ns)) / NS_PER_S
        near_s = steps_s[~between_islands(steps_s)]
        span_s = float(near_s.sum())
        return cls(
            rate_hz=len(near_s) / span_s if span_s > 0 else None,
            longest_gap_s=float(steps_s.max()),
            jitter_s=float(np.median(np.abs(steps_s - np.median(steps_s)))),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Topic:
    """All messages of one topic, in order of receive time.

    Attributes:
        name: the topic.
        parts: the channels that make it up, each with its file.
        part: (n,) the part each message belongs to.
        receive_ns: (n,) the recorder's clock.
        chunk: (n,) see MessageIndex.
        offset: (n,) see MessageIndex.
        repeated: how many messages were skipped because an earlier file also contains them.
    """

    name: str
    parts: tuple[tuple[Source, Channel], ...]
    part: Indices
    receive_ns: TimesNs
    chunk: Indices
    offset: Indices
    repeated: int = 0

    def __len__(self) -> int:
        return len(self.receive_ns)

    @property
    def type(self) -> str:
        """The message type as the recording spells it."""
        return self.parts[0][1].type

    def definition(self, part: int = 0) -> Definition:
        """Return the definition of a part's messages.

        Raises:
            MessageError: there is none, or it cannot be parsed.
        """
        return definition_of(self.parts[part][1])

    def payload(self, row: int) -> bytes:
        """Read one message."""
        return ros_message(*self.stored(row))

    def stored(self, row: int) -> tuple[Channel, bytes]:
        """Read one message as it is stored, and return its channel."""
        source, channel = self.parts[int(self.part[row])]
        return channel, source.read(int(self.chunk[row]), int(self.offset[row]))

    def message(self, row: int) -> Message:
        """Read and decode one message."""
        return decode(self.definition(int(self.part[row])), self.payload(row))

    def heads(self, rows: np.ndarray, size: int) -> Heads:
        """Read the first bytes of many messages, in the order of rows."""
        return read_heads([(self, rows)], size)[0]

    def take(self, rows: np.ndarray) -> "Topic":
        """Keep the given messages."""
        return replace(
            self,
            part=self.part[rows],
            receive_ns=self.receive_ns[rows],
            chunk=self.chunk[rows],
            offset=self.offset[rows],
        )

    def stamps_in(self, heads: np.ndarray) -> TimesNs | None:
        """Extract the stamps from the first 12 bytes of all messages; None if the type does not begin with one."""
        offsets = [self.definition(number).stamp_offset for number in range(len(self.parts))]
        if any(offset is None for offset in offsets):
            return None
        starts = np.array(offsets, dtype=np.int64)[self.part]
        words = np.take_along_axis(heads, starts[:, None] + np.arange(8), axis=1)
        cdr = np.array([channel.encoding == "cdr" for _, channel in self.parts])[self.part]
        big = cdr & (heads[:, 1] == 0)
        words[big] = words[big][:, [3, 2, 1, 0, 7, 6, 5, 4]]
        pairs = np.ascontiguousarray(words).view("<u4").astype(np.int64)
        return pairs[:, 0] * NS_PER_S + pairs[:, 1]


def read_heads(wanted: Sequence[tuple[Topic, np.ndarray]], size: int, *, keep: bool = False) -> list[Heads]:
    """Read the first bytes of messages of several topics, file by file; see Source.heads for keep."""
    if any(is_foxglove(channel) for topic, _ in wanted for _, channel in topic.parts):
        return [
            _foxglove_heads(topic, rows, size)
            if any(is_foxglove(channel) for _, channel in topic.parts)
            else read_heads([(topic, rows)], size, keep=keep)[0]
            for topic, rows in wanted
        ]
    if len(wanted) == 1 and len(wanted[0][0].parts) == 1:
        topic, rows = wanted[0]
        index = MessageIndex(topic.receive_ns[rows], topic.chunk[rows], topic.offset[rows])
        return [topic.parts[0][0].heads(index, size, keep=keep)]
    header_columns = [
        Heads(np.zeros((len(rows), size), dtype=np.uint8), np.zeros(len(rows), dtype=np.int64)) for _, rows in wanted
    ]
    places: dict[int, list[tuple[int, np.ndarray]]] = {}
    sources: dict[int, Source] = {}
    for number, (topic, rows) in enumerate(wanted):
        parts = topic.part[rows]
        for part, (source, _) in enumerate(topic.parts):
            mine = np.flatnonzero(parts == part)
            if len(mine):
                sources[id(source)] = source
                places.setdefault(id(source), []).append((number, mine))
    for key, shares in places.items():
        picked = [wanted[number][0].take(wanted[number][1][mine]) for number, mine in shares]
        index = MessageIndex(
            *(np.concatenate([getattr(t, n) for t in picked]) for n in ("receive_ns", "chunk", "offset"))
        )
        heads = sources[key].heads(index, size, keep=keep)
        edges = np.cumsum([0, *map(len, picked)])
        for (number, mine), first, last in zip(shares, edges[:-1], edges[1:], strict=True):
            header_columns[number].rows[mine] = heads.rows[first:last]
            header_columns[number].lengths[mine] = heads.lengths[first:last]
            header_columns[number] = replace(header_columns[number], fault=header_columns[number].fault or heads.fault)
    return header_columns


def _foxglove_heads(topic: Topic, rows: np.ndarray, size: int) -> Heads:
    """Read the first bytes of messages as ROS serialises them: the stamp from their own first bytes, more from all of them."""
    heads = Heads(np.zeros((len(rows), size), dtype=np.uint8), np.zeros(len(rows), dtype=np.int64))
    fault = ""
    for part, (source, channel) in enumerate(topic.parts):
        mine = np.flatnonzero(topic.part[rows] == part)
        own = rows[mine]
        index = MessageIndex(topic.receive_ns[own], topic.chunk[own], topic.offset[own])
        firsts = source.heads(index, HEAD_BYTES).rows if size <= STAMP_BYTES and is_foxglove(channel) else ()
        for number, (place, row) in enumerate(zip(mine.tolist(), own.tolist(), strict=True)):
            head = ros_head(channel, firsts[number].tobytes()) if len(firsts) else None
            try:
                head = topic.payload(row) if head is None else head
            except RecordingError as error:
                head, fault = None, fault or str(error)
            heads.lengths[place] = -1 if head is None else len(head)
            if head is not None:
                heads.rows[place, : min(len(head), size)] = np.frombuffer(head[:size], dtype=np.uint8)
    return replace(heads, fault=fault)


def join_topics(
    sources: tuple[Source, ...], only: Collection[str] | None = None
) -> tuple[tuple[Topic, ...], tuple[DataWarning, ...]]:
    """Join the channels of all files by topic, and warn about files that repeat each other's messages.

    Args:
        sources: the files.
        only: the topics wanted; None for all.
    """
    found: dict[str, list[tuple[Source, Channel]]] = {}
    for source in sources:
        for channel in source.channels:
            if only is not None and channel.topic not in only:
                continue
            found.setdefault(channel.topic, []).append((source, channel))
    topics = tuple(_join(name, tuple(parts)) for name, parts in sorted(found.items()))
    repeated = sum(topic.repeated for topic in topics)
    if not repeated:
        return topics, ()
    where = ", ".join(topic.name for topic in topics if topic.repeated)
    warning = DataWarning.reported(
        "repeated-messages",
        f"{repeated} messages of {where} occur in several files; each is used once",
        "give each recording only once: a folder that also contains a converted copy counts twice",
    )
    return topics, (warning,)


def _join(name: str, parts: tuple[tuple[Source, Channel], ...]) -> Topic:
    if len(parts) == 1:  # of one file: in order already, and without copies, for there may be millions
        source, channel = parts[0]
        index = source.index(channel.id)
        part = np.zeros(len(index), dtype=np.int64)
        return Topic(name, parts, part, index.receive_ns, index.chunk, index.offset)
    columns: list[np.ndarray] = []
    seen: dict[int, np.ndarray] = {}
    repeated = 0
    for number, (source, channel) in enumerate(parts):
        index = source.index(channel.id)
        keep = np.ones(len(index), dtype=bool)
        for other, times in seen.items():
            if other != id(source):
                keep &= ~np.isin(index.receive_ns, times)
        repeated += int(np.count_nonzero(~keep))
        mine = seen.get(id(source))
        seen[id(source)] = index.receive_ns if mine is None else np.concatenate([mine, index.receive_ns])
        kept = index.take(np.flatnonzero(keep))
        columns.append(np.stack([np.full(len(kept), number), kept.receive_ns, kept.chunk, kept.offset]))
    part, receive_ns, chunk, offset = np.concatenate(columns, axis=1).astype(np.int64)
    order = np.lexsort((part, receive_ns))  # stable: messages with equal times keep the order of their file
    return Topic(name, parts, part[order], receive_ns[order], chunk[order], offset[order], repeated)


@dataclass(frozen=True, slots=True, eq=False)
class StampedTopic:
    """The readable messages of a topic, with their stamps.

    Attributes:
        topic: without the unreadable messages.
        header_ns: (n,) None if the type does not begin with a stamp.
        heads: (n, size) uint8, the first bytes of the messages.
        lost: how many messages cannot be read.
        fault: why the first of them cannot.
    """

    topic: Topic
    header_ns: TimesNs | None
    heads: np.ndarray
    lost: int = 0
    fault: str = ""

    def clocks(self, distinct: float) -> Stamps:
        """Return both clocks of the topic.

        Args:
            distinct: the least share of different times that is plausible, see Stamps.
        """
        files = list({id(source): None for source, _ in self.topic.parts})
        number = np.array([files.index(id(source)) for source, _ in self.topic.parts], dtype=np.int64)[self.topic.part]
        written = np.lexsort((self.topic.offset, self.topic.chunk, number))
        return Stamps(self.topic.name, self.topic.receive_ns, self.header_ns, distinct, written)


def read_stamps(topics: Sequence[tuple[Topic, int]]) -> tuple[StampedTopic, ...]:
    """Read the stamps of several topics; unreadable messages are skipped, and the reason is kept.

    All topics are read in one pass, so a compressed chunk with messages of several of them is decompressed once.

    Args:
        topics: each with the number of bytes to keep of each message; the stamp takes 12.
    """
    size = max((wanted for _, wanted in topics), default=0)
    header_columns = read_heads([(topic, np.arange(len(topic))) for topic, _ in topics], size, keep=True)
    stamped = []
    for (topic, wanted), heads in zip(topics, header_columns, strict=True):
        readable = heads.lengths >= 0
        kept = topic if readable.all() else topic.take(np.flatnonzero(readable))
        rows = heads.rows[readable]
        lost = int(np.count_nonzero(~readable))
        stamps = kept.stamps_in(rows[:, :12]) if len(kept) else None
        stamped.append(StampedTopic(kept, stamps, rows[:, :wanted], lost, heads.fault))
    return tuple(stamped)
