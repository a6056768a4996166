"""In which order the pictures of a long recording are searched: first all over it, then ever more finely where the board is."""

from collections.abc import Callable, Collection
from itertools import pairwise

import numpy as np

from calib_core.measurements import NS_PER_S, TimeNs

_EVERY_ONE = 300
_FIRST_PASS = 180
_MOST = 420
_FINEST_S = 0.3
_USUAL_RATE_HZ = 30.0


class PictureOrder:
    """Batches of pictures to search, each chosen by what was found before. The order does not depend on how fast anything is."""

    def __init__(self, count: int, time_ns: Callable[[int], TimeNs | None]) -> None:
        """Set up the order.

        Args:
            count: of pictures.
            time_ns: of a picture by its number; None if nothing says.
        """
        self._count = count
        self._asked: set[int] = set()
        self._finest = max(1, round(_FINEST_S * _rate_hz(count, time_ns)))
        self.total = count if count <= _EVERY_ONE else _FIRST_PASS
        """Pictures to search, as far as known."""

    def next_batch(self, found: Collection[int]) -> list[int]:
        """Return the numbers of the pictures to search next; none at the end.

        Args:
            found: numbers of the pictures in which the board was found so far.
        """
        if not self._asked:
            batch = self._everywhere()
        else:
            batch = [] if self._count <= _EVERY_ONE else self._between(sorted(self._asked), set(found))
        self._asked.update(batch)
        self.total = max(self.total, len(self._asked))
        return batch

    def _everywhere(self) -> list[int]:
        """Return pictures all over the recording, such that the first ones are far apart."""
        if self._count <= _EVERY_ONE:
            return list(range(self._count))
        even = np.linspace(0, self._count - 1, _FIRST_PASS).round().astype(int)
        return list(dict.fromkeys(even[_far_apart(len(even))].tolist()))

    def _between(self, asked: list[int], found: set[int]) -> list[int]:
        """Return the middles of the gaps beside pictures with the board, the widest first, as far as the number allows."""
        gaps = [
            (after - before, (before + after) // 2)
            for before, after in pairwise(asked)
            if after - before > self._finest and (before in found or after in found)
        ]
        gaps.sort(key=lambda gap: (-gap[0], gap[1]))
        return [middle for _, middle in gaps[: _MOST - len(self._asked)]]


def _rate_hz(count: int, time_ns: Callable[[int], TimeNs | None]) -> float:
    first, last = (time_ns(0), time_ns(count - 1)) if count > 1 else (None, None)
    if first is None or last is None or last <= first:
        return _USUAL_RATE_HZ
    return (count - 1) * NS_PER_S / (last - first)


def _far_apart(count: int) -> np.ndarray:
    """Return 0 to count - 1 in the order of their reversed binary digits."""
    bits = max(1, int(count - 1).bit_length())
    reversed_digits = [int(f"{number:0{bits}b}"[::-1], 2) for number in range(1 << bits)]
    order = np.array(reversed_digits)
    return np.asarray(order[order < count])
