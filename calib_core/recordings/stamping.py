"""The stamps of the topics in use, read in one pass over the files."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.recordings.time.clock_choice import Stamps
from calib_core.recordings.topics import Topic, read_heads


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
    found = read_heads([(topic, np.arange(len(topic))) for topic, _ in topics], size, keep=True)
    stamped = []
    for (topic, wanted), heads in zip(topics, found, strict=True):
        readable = heads.lengths >= 0
        kept = topic if readable.all() else topic.take(np.flatnonzero(readable))
        rows = heads.rows[readable]
        lost = int(np.count_nonzero(~readable))
        stamps = kept.stamps_in(rows[:, :12]) if len(kept) else None
        stamped.append(StampedTopic(kept, stamps, rows[:, :wanted], lost, heads.fault))
    return tuple(stamped)
