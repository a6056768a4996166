"""Still images: what the camera saw during a stretch of a dwell, without whoever walked past.

While two reflectors are moved in turn, their dwells overlap; a dwell then has a still image for every set of placements
that stood together, so that what changed can be told apart. Images are brought to one light before they are compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.association.placements import Placement
from calib_core.errors import CalibrationError
from calib_core.measurements import NS_PER_S, TimeNs


class FrameSource(Protocol):
    """Camera frames by number; a `Recording` is one. Only the frames that are asked for are decoded."""

    @property
    def image_times(self) -> TimesNs:
        """Their stamps, ascending [ns]."""
        ...

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first. Several threads may call it at once.

        Raises:
            CalibrationError: it cannot be read.
        """
        ...


_FRAMES = 7
"""Images whose median shows a dwell without whoever walks past."""
_AT_ENDS_S = 0.6
"""Left out at the ends of a dwell, where hands are still at the reflector."""
_WORKING_WIDTH_PX = 960
_CLEAR_FRAMES = 3
"""Of these seven: what is looked at again at full resolution."""
_EVERY = 4
_LEAST_FRAMES = 2
"""Of a stretch in which other placements stand than in the rest of the dwell; shorter stretches are left out."""


@dataclass(frozen=True, slots=True, eq=False)
class StillImage:
    """The median of frames during which the same placements stood.

    Attributes:
        image: (h, w, 3) uint8, reduced.
        standing: numbers of the placements that stood.
        time: stamp in the middle of its frames.
    """

    image: np.ndarray
    standing: frozenset[int]
    time: TimeNs


@dataclass(frozen=True, slots=True, eq=False)
class SeenFrames:
    """Frames of one dwell, decoded and reduced, all in the light of the middle one.

    Attributes:
        numbers: (k,) of the frames that could be read.
        images: of each (h, w, 3) uint8.
        factor: width of the full image over that of these.
    """

    numbers: Indices
    images: tuple[np.ndarray, ...]
    factor: float

    def clearest(self, image: np.ndarray) -> Indices:
        """Return the numbers of the few frames that differ least from an image, ascending.

        Args:
            image: (h, w, 3) uint8, their median.
        """
        usual = image[::_EVERY, ::_EVERY].astype(np.int16)
        off = [float(np.abs(one[::_EVERY, ::_EVERY] - usual).mean()) for one in self.images]
        return np.sort(self.numbers[np.argsort(off, kind="stable")[:_CLEAR_FRAMES]])


def frames_within(placement: Placement, image_times: TimesNs) -> Indices:
    """Return the numbers of a few frames, spread over a dwell but for its ends.

    Args:
        placement: of the radar.
        image_times: stamps of all frames, ascending.
    """
    inset_ns = min(int(_AT_ENDS_S * NS_PER_S), (placement.end - placement.start) // 4)
    inside = np.flatnonzero((image_times >= placement.start + inset_ns) & (image_times <= placement.end - inset_ns))
    chosen = np.linspace(0, len(inside) - 1, min(_FRAMES, len(inside))).round().astype(np.int64)
    return np.asarray(inside[np.unique(chosen)])


def seen_frames(numbers: Indices, frames: FrameSource) -> SeenFrames:
    """Decode and reduce frames; one that cannot be read is left out.

    Args:
        numbers: (k,) of the frames.
        frames: of the camera.
    """
    import cv2

    read, images, factor = [], [], 1.0
    for number in numbers.tolist():
        try:
            full = frames.image(number)
        except CalibrationError:
            continue
        factor = max(1.0, full.shape[1] / _WORKING_WIDTH_PX)
        size = (round(full.shape[1] / factor), round(full.shape[0] / factor))
        read.append(number)
        images.append(cv2.resize(full, size, interpolation=cv2.INTER_AREA) if factor > 1.0 else full)
    middle = images[len(images) // 2] if images else None
    return SeenFrames(
        np.array(read, dtype=np.int64),
        tuple(in_light_of(middle, image) for image in images if middle is not None),
        factor,
    )


def still_images(
    number: int, placements: Sequence[Placement], seen: SeenFrames, image_times: TimesNs
) -> tuple[StillImage, ...]:
    """Take the median of the frames of a dwell, for each set of placements that stood together.

    Args:
        number: of the placement whose frames these are.
        placements: all.
        seen: frames of that placement.
        image_times: stamps of all frames.
    """
    groups: dict[frozenset[int], list[int]] = {}
    for k, time in enumerate(image_times[seen.numbers].tolist()):
        standing = frozenset(i for i, placement in enumerate(placements) if placement.start <= time <= placement.end)
        groups.setdefault(standing | {number}, []).append(k)
    least = min(_LEAST_FRAMES, max(map(len, groups.values()), default=0))
    return tuple(
        StillImage(
            stack_median([seen.images[k] for k in rows]),
            standing,
            TimeNs(int(image_times[seen.numbers[rows[len(rows) // 2]]])),
        )
        for standing, rows in groups.items()
        if len(rows) >= least
    )


def stack_median(images: Sequence[np.ndarray]) -> np.ndarray:
    """Return the median of images of one shape and type; of an even number the mean of both middle ones.

    Args:
        images: at least one; uint8, uint16 or float32.
    """
    import cv2

    stack = list(images)
    middle = len(stack) // 2
    for last in range(len(stack) - 1, max(middle - 2, 0), -1):  # the largest of what is left rises to the end
        for low in range(last):
            stack[low], stack[low + 1] = cv2.min(stack[low], stack[low + 1]), cv2.max(stack[low], stack[low + 1])
    if len(stack) % 2:
        return np.asarray(stack[middle])
    return np.asarray(cv2.addWeighted(stack[middle - 1], 0.5, stack[middle], 0.5, 0.0))


_EVERY_PIXEL = 6
"""A gain is fitted to one row and column in so many."""
_DARK_GREY, _BRIGHT_GREY = 12, 243
_SHADE_SHARE = 0.16
"""Side of the square over which the light is compared, of the image's width: what is smaller is not a change of light."""
_REDUCED = 8
_SAME_LIGHT = 0.015
_LEAST_SHADE, _MOST_SHADE = 0.7, 1.4


def channel_gains(image: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return by how much to multiply each channel of a reference so that most of it looks like an image: (3,).

    Args:
        image: (h, w, 3) uint8.
        reference: (h, w, 3) uint8.
    """
    one, other = (
        each[_EVERY_PIXEL // 2 :: _EVERY_PIXEL, _EVERY_PIXEL // 2 :: _EVERY_PIXEL] for each in (image, reference)
    )
    gains = np.ones(3)
    for channel in range(3):
        a, b = one[..., channel], other[..., channel]
        told = (np.minimum(a, b) > _DARK_GREY) & (np.maximum(a, b) < _BRIGHT_GREY)
        if np.count_nonzero(told) >= 50:
            gains[channel] = float(np.median(a[told].astype(np.float32) / b[told]))
    return gains


def in_same_light(image: np.ndarray, gains: np.ndarray, *, levels_per_grey: float) -> np.ndarray:
    """Return an image with its channels multiplied: (h, w, 3) uint16, so many levels per level of grey.

    Args:
        image: (h, w, 3) uint8.
        gains: (3,) of its channels.
        levels_per_grey: how fine.
    """
    import cv2

    factors = np.array([*(levels_per_grey * gains), 0.0])
    return np.asarray(cv2.multiply(image, factors, dtype=cv2.CV_16U))


def in_light_of(reference: np.ndarray, image: np.ndarray) -> np.ndarray:
    """Return an image in the light of another one: (h, w, 3) uint8; the image itself if that hardly differs.

    Args:
        reference: (h, w, 3) uint8.
        image: (h, w, 3) uint8.
    """
    import cv2

    gains = channel_gains(reference, image)
    if image is reference or np.abs(gains - 1.0).max() < _SAME_LIGHT:
        return image
    return np.asarray(cv2.convertScaleAbs(in_same_light(image, gains, levels_per_grey=64.0), alpha=1.0 / 64.0))


def local_light(image: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """Return how much brighter the surroundings of each pixel are than usual: (h, w, 1) float32, about 1.

    Args:
        image: (h, w, 3) float32.
        usual: (h, w, 3) float32, with the gains of the channels applied.
    """
    import cv2

    height, width = image.shape[:2]
    small = (max(1, width // _REDUCED), max(1, height // _REDUCED))
    one, other = (
        cv2.cvtColor(cv2.resize(each, small, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY)
        for each in (image, usual)
    )
    share = (np.clip((one + 4.0) / (other + 4.0), _LEAST_SHADE, _MOST_SHADE) - _LEAST_SHADE) / (
        _MOST_SHADE - _LEAST_SHADE
    )
    side = max(3, round(_SHADE_SHARE * small[0]) | 1)
    levels = cv2.medianBlur(np.round(255.0 * share).astype(np.uint8), side).astype(np.float32)
    ratio = _LEAST_SHADE + (_MOST_SHADE - _LEAST_SHADE) / 255.0 * cv2.blur(levels, (side, side))
    return np.asarray(cv2.resize(ratio, (width, height), interpolation=cv2.INTER_LINEAR))[..., None]
