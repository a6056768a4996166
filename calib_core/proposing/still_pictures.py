"""Still pictures: what the camera saw during a stretch of a dwell, without whoever walked past.

While two reflectors are moved in turn, their dwells overlap; a dwell then has a still picture for every set of placements
that stood together, so that what changed can be told apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.association.placements import Placement
from calib_core.errors import CalibrationError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.proposing.frame_source import FrameSource
from calib_core.proposing.light import in_light_of
from calib_core.proposing.stack_median import stack_median

_FRAMES = 7
"""Pictures whose median shows a dwell without whoever walks past."""
_AT_ENDS_S = 0.6
"""Left out at the ends of a dwell, where hands are still at the reflector."""
_WORKING_WIDTH_PX = 960
_CLEAR_FRAMES = 3
"""Of these seven: what is looked at again at full resolution."""
_EVERY = 4
_LEAST_FRAMES = 2
"""Of a stretch in which other placements stand than in the rest of the dwell; shorter stretches are left out."""


@dataclass(frozen=True, slots=True, eq=False)
class StillPicture:
    """The median of frames during which the same placements stood.

    Attributes:
        picture: (h, w, 3) uint8, reduced.
        standing: numbers of the placements that stood.
        time: stamp in the middle of its frames.
    """

    picture: np.ndarray
    standing: frozenset[int]
    time: TimeNs


@dataclass(frozen=True, slots=True, eq=False)
class SeenFrames:
    """Frames of one dwell, decoded and reduced, all in the light of the middle one.

    Attributes:
        numbers: (k,) of the frames that could be read.
        pictures: of each (h, w, 3) uint8.
        factor: width of the full picture over that of these.
    """

    numbers: Indices
    pictures: tuple[np.ndarray, ...]
    factor: float

    def clearest(self, picture: np.ndarray) -> Indices:
        """Return the numbers of the few frames that differ least from a picture, ascending.

        Args:
            picture: (h, w, 3) uint8, their median.
        """
        usual = picture[::_EVERY, ::_EVERY].astype(np.int16)
        off = [float(np.abs(one[::_EVERY, ::_EVERY] - usual).mean()) for one in self.pictures]
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

    read, pictures, factor = [], [], 1.0
    for number in numbers.tolist():
        try:
            full = frames.image(number)
        except CalibrationError:
            continue
        factor = max(1.0, full.shape[1] / _WORKING_WIDTH_PX)
        size = (round(full.shape[1] / factor), round(full.shape[0] / factor))
        read.append(number)
        pictures.append(cv2.resize(full, size, interpolation=cv2.INTER_AREA) if factor > 1.0 else full)
    middle = pictures[len(pictures) // 2] if pictures else None
    return SeenFrames(
        np.array(read, dtype=np.int64),
        tuple(in_light_of(middle, picture) for picture in pictures if middle is not None),
        factor,
    )


def still_pictures(
    number: int, placements: Sequence[Placement], seen: SeenFrames, image_times: TimesNs
) -> tuple[StillPicture, ...]:
    """Take the median of the frames of a dwell, for each set of placements that stood together.

    Args:
        number: of the placement whose frames these are.
        placements: all.
        seen: frames of that placement.
        image_times: stamps of all frames.
    """
    groups: dict[frozenset[int], list[int]] = {}
    for k, time in enumerate(image_times[seen.numbers].tolist()):
        standing = frozenset(i for i, one in enumerate(placements) if one.start <= time <= one.end)
        groups.setdefault(standing | {number}, []).append(k)
    least = min(_LEAST_FRAMES, max(map(len, groups.values()), default=0))
    return tuple(
        StillPicture(
            stack_median([seen.pictures[k] for k in rows]),
            standing,
            TimeNs(int(image_times[seen.numbers[rows[len(rows) // 2]]])),
        )
        for standing, rows in groups.items()
        if len(rows) >= least
    )
