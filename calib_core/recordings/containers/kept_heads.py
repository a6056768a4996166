"""The first bytes of messages, kept while a file grows, so that each is read once."""

from collections.abc import Callable

import numpy as np

from calib_core.recordings.containers.sources import Heads, MessageIndex

_OFFSET_BITS = 40  # a file of a terabyte


class KeptHeads:
    """Heads by message, for one number of bytes at a time. Not thread-safe.

    Args:
        by_row: messages are told apart by their chunk alone, as the rows of a database are.
    """

    def __init__(self, *, by_row: bool = False) -> None:
        self._shift = 0 if by_row else _OFFSET_BITS
        self._forget(0)

    def _forget(self, size: int) -> None:
        self._size = size
        self._keys = np.zeros(0, dtype=np.int64)
        self._rows = np.zeros((0, size), dtype=np.uint8)
        self._lengths = np.zeros(0, dtype=np.int64)

    def read(self, index: MessageIndex, size: int, read: Callable[[MessageIndex, int], Heads]) -> Heads:
        """Return the heads of messages in the order of the index; read those that are not kept yet.

        Args:
            index: the messages.
            size: number of bytes of each.
            read: reads the heads of messages.
        """
        if size != self._size:
            self._forget(size)
        keys = (index.chunk << self._shift) | index.offset
        new = np.flatnonzero(~self._kept(keys))
        fault = ""
        if len(new):
            heads = read(index.take(new), size)
            fault = heads.fault
            self._keep(keys[new], heads)
        places = np.searchsorted(self._keys, keys)
        return Heads(self._rows[places], self._lengths[places], fault)

    def _kept(self, keys: np.ndarray) -> np.ndarray:
        if not len(self._keys):
            return np.zeros(len(keys), dtype=bool)
        places = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return np.asarray(self._keys[places] == keys)

    def _keep(self, keys: np.ndarray, heads: Heads) -> None:
        all_keys = np.concatenate([self._keys, keys])
        order = np.argsort(all_keys, kind="stable")
        self._keys = all_keys[order]
        self._rows = np.concatenate([self._rows, heads.rows])[order]
        self._lengths = np.concatenate([self._lengths, heads.lengths])[order]
