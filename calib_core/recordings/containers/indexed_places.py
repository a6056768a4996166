"""Compare an index with the messages found by reading a whole file."""

from collections.abc import Mapping

import numpy as np

from calib_core.arrays import Indices
from calib_core.recordings.containers.accounts import AccountBuilder
from calib_core.recordings.containers.sources import MessageIndex


class IndexedPlaces:
    """The places that an index names, chunk by chunk.

    Args:
        indexes: of each channel.
        positions: the position in the file of each chunk's data.
        leads: an entry may name a declaration directly before its message.
    """

    def __init__(self, indexes: Mapping[int, MessageIndex], positions: list[int], *, leads: bool = False) -> None:
        self._leads = leads
        self._numbers = {position: number for number, position in enumerate(positions)}
        self._places = {
            channel: (index.chunk[order], index.offset[order])
            for channel, index in indexes.items()
            for order in (np.lexsort((index.offset, index.chunk)),)
        }

    def of(self, channel: int, position: int) -> Indices:
        """Return the offsets of a channel's messages in the chunk at a position, ascending."""
        number = self._numbers.get(position)
        if channel not in self._places or number is None:
            return np.zeros(0, dtype=np.int64)
        chunk, offset = self._places[channel]
        first, last = np.searchsorted(chunk, [number, number + 1])
        return offset[first:last]

    def channels(self) -> frozenset[int]:
        """Return the channels that have messages."""
        return frozenset(self._places)

    def compare(self, builder: AccountBuilder, position: int, found: Mapping[int, list[int]], *, damaged: bool) -> None:
        """Compare the index of one chunk with the messages found in it.

        Args:
            builder: counts the messages that the index misses, and those that it names but that are not there.
            position: of the chunk's data.
            found: the offsets of the messages by channel.
            damaged: the chunk fails its checksum, so that none of its messages can be trusted.
        """
        for channel in self.channels() | found.keys():
            there = np.unique(np.array(found.get(channel, []), dtype=np.int64))
            named = np.unique(self.of(channel, position))
            if self._leads:
                named = _behind(named, there, found)
            missed = int(np.count_nonzero(~np.isin(there, named)))
            absent = len(named) if damaged else int(np.count_nonzero(~np.isin(named, there)))
            if missed:
                builder.unindexed[channel] = builder.unindexed.get(channel, 0) + missed
            if absent:
                builder.damaged[channel] = builder.damaged.get(channel, 0) + absent


def _behind(named: Indices, there: Indices, found: Mapping[int, list[int]]) -> Indices:
    """Replace entries that name the declaration before a message by the message, if that is the next one of all."""
    everything = np.unique(np.concatenate([np.array(offsets, dtype=np.int64) for offsets in found.values()] or [there]))
    following = np.searchsorted(everything, named)
    known = following < len(everything)
    behind = named.copy()
    behind[known] = everything[following[known]]
    return np.where(np.isin(behind, there), behind, named)
