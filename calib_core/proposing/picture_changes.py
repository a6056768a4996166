"""Picture changes: how much a still picture differs from the same place at other times, and what of it is of one size."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.measurements import TimeNs
from calib_core.proposing.light import channel_gains, in_same_light, local_light
from calib_core.proposing.stack_median import stack_median
from calib_core.proposing.still_pictures import StillPicture

_OTHERS = 9
_LEAST_OTHERS = 2
_LEVELS_PER_GREY = 64.0
_FLOOR_GREY = 3.0
"""Scatter of a pixel at least: compression and sensor."""
_MOST_SIGMAS = 8.0
"""A pixel counts no more than this: a bright one is no better evidence than many."""
_RING = 1.2
"""Weight of the mean around the square: what is larger than a reflector, such as a person, cancels."""
_PART, _PART_COUNTS = 0.6, 0.8
"""Width of a part of the reflector that is looked for as well, and how much it counts."""
_NEXT = 1.2
"""How far on both sides of a place a limb goes on, in widths of the reflector."""
_BODY = (1.6, 3.0)
"""Width and height of what is taken for a body below a head, in widths of the reflector."""
_SPARSE = 0.4
"""What is changed by less than this share, such as the legs of a tripod, is no body."""


def least_others() -> int:
    """Return how many other still pictures are needed to say what changed."""
    return _LEAST_OTHERS


def nearest_others(number: int, time: TimeNs, stills: Iterable[StillPicture]) -> list[StillPicture]:
    """Return the still pictures nearest in time in which a placement did not stand; at most nine.

    Args:
        number: of the placement.
        time: in its middle.
        stills: of all placements.
    """
    others = [still for still in stills if number not in still.standing]
    others.sort(key=lambda still: abs(still.time - time))
    return others[:_OTHERS]


def changed_places(
    own: Sequence[StillPicture],
    others: Sequence[StillPicture],
    width_px: float,
    *,
    without: Sequence[StillPicture] = (),
) -> np.ndarray:
    """Return how strongly each place changed at one size: (h, w) float32, in standard deviations.

    Args:
        own: of one placement, at least one; only what is in all of them counts.
        others: in which it did not stand.
        width_px: of the reflector in these pictures.
        without: of simultaneous placements while this one did not stand; what changed there too is theirs.
    """
    import cv2

    usual = _Usual.of(own[0].picture, others)
    response = _of_size(usual.change_of(own[0].picture), width_px)
    for still in own[1:]:
        response = cv2.min(response, _of_size(usual.change_of(still.picture), width_px))
    for still in without:
        response -= np.maximum(_of_size(usual.change_of(still.picture), width_px), np.float32(0.0))
    return np.asarray(response)


@dataclass(frozen=True, slots=True, eq=False)
class _Usual:
    """What the scene looks like without the placement, in the light of its picture.

    Attributes:
        reference: (h, w, 3) uint8, the picture whose light it is.
        median: (h, w, 3) float32 [grey levels].
        scatter: (h, w, 3) float32, standard deviation [grey levels].
    """

    reference: np.ndarray
    median: np.ndarray
    scatter: np.ndarray

    @classmethod
    def of(cls, reference: np.ndarray, others: Sequence[StillPicture]) -> "_Usual":
        import cv2

        stack = [
            in_same_light(other.picture, channel_gains(reference, other.picture), levels_per_grey=_LEVELS_PER_GREY)
            for other in others
        ]
        median = stack_median(stack)
        scatter = stack_median([cv2.absdiff(one, median) for one in stack])
        return cls(
            reference,
            median.astype(np.float32) / np.float32(_LEVELS_PER_GREY),
            scatter.astype(np.float32) * np.float32(1.48 / _LEVELS_PER_GREY) + np.float32(_FLOOR_GREY),
        )

    def change_of(self, picture: np.ndarray) -> np.ndarray:
        """Return how far each pixel lies from what is usual: (h, w) float32, in standard deviations."""
        median = self.median
        if picture is not self.reference:
            median = median * channel_gains(picture, self.reference).astype(np.float32)
        shown = picture.astype(np.float32)
        off = (shown - local_light(shown, median) * median) / self.scatter
        return np.asarray(np.sqrt(np.einsum("ijk,ijk->ij", off, off)))


def _of_size(change: np.ndarray, width_px: float) -> np.ndarray:
    """Return how much a place of about one size stands out; part of the reflector may look like what is behind it."""
    whole, part = (_stands_out(change, share * width_px) for share in (1.0, _PART))
    return np.maximum(whole, np.float32(_PART_COUNTS) * part)


def _stands_out(change: np.ndarray, width_px: float) -> np.ndarray:
    """Return the mean change in a square of one size, less that around it."""
    import cv2

    side = max(3, 2 * round(0.5 * width_px) + 1)
    clipped = np.minimum(change, np.float32(_MOST_SIGMAS))
    inner = cv2.blur(clipped, (side, side))
    wide = 2 * side + 1
    ring = (cv2.blur(clipped, (wide, wide)) * wide**2 - inner * side**2) / (wide**2 - side**2)
    more = cv2.max(np.float32(_RING) * ring, _of_a_larger_thing(clipped, inner, side))
    return np.asarray(inner - more)


def _of_a_larger_thing(change: np.ndarray, inner: np.ndarray, side: int) -> np.ndarray:
    """Return how much changed on both sides of each place, and in a body below or above it: the least of a limb or a head."""
    import cv2

    step = round(_NEXT * side)
    lines = [cv2.min(_moved(inner, *way), _moved(inner, -way[0], -way[1])) for way in ((step, 0), (0, step))]
    body = cv2.blur(change, (round(_BODY[0] * side) | 1, round(_BODY[1] * side) | 1))
    away = round((0.5 + 0.5 * _BODY[1]) * side)
    body = np.maximum(body - np.float32(_SPARSE * _MOST_SIGMAS), np.float32(0.0)) * np.float32(1.0 / (1.0 - _SPARSE))
    bodies = [_moved(body, 0, away), _moved(body, 0, -away)]
    return np.asarray(cv2.max(cv2.max(*lines), cv2.max(*bodies)))


def _moved(picture: np.ndarray, right: int, down: int) -> np.ndarray:
    """Return what a picture shows so far to the right of, and below, each pixel; 0 beyond its edges."""
    import cv2

    move = np.array([[1.0, 0.0, -right], [0.0, 1.0, -down]])
    return np.asarray(cv2.warpAffine(picture, move, picture.shape[1::-1], flags=cv2.INTER_NEAREST))
