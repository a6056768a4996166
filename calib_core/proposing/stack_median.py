"""The median of a few pictures of one camera, pixel by pixel, at the speed of the processor's minimum and maximum."""

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np


def stack_median(pictures: Sequence[np.ndarray]) -> np.ndarray:
    """Return the median of pictures of one shape and type; of an even number the mean of both middle ones.

    Args:
        pictures: at least one; uint8, uint16 or float32.
    """
    import cv2

    stack = list(pictures)
    for low, high in _exchanges(len(stack)):
        stack[low], stack[high] = cv2.min(stack[low], stack[high]), cv2.max(stack[low], stack[high])
    middle = len(stack) // 2
    if len(stack) % 2:
        return np.asarray(stack[middle])
    return np.asarray(cv2.addWeighted(stack[middle - 1], 0.5, stack[middle], 0.5, 0.0))


@lru_cache(maxsize=32)
def _exchanges(count: int) -> tuple[tuple[int, int], ...]:
    """Return the exchanges of Batcher's merge sort of so many rows."""
    return tuple(_merge_exchange(count))


def _merge_exchange(count: int) -> Iterator[tuple[int, int]]:
    first = 1 << max(count - 1, 0).bit_length() >> 1
    step = first
    while step:
        wide, part, apart = first, 0, step
        while True:
            yield from ((row, row + apart) for row in range(count - apart) if row & step == part)
            if wide == step:
                break
            apart, wide, part = wide - step, wide >> 1, step
        step >>= 1
