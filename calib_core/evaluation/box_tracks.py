"""Box tracks: which boxes of successive frames are around one object, as their source says, or by how they move."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, TimesNs, frozen_array
from calib_core.detections import Box, Boxes

_LONGEST_STEP = 0.8  # widths or heights from where a box is expected, for a box of the same object
_LONGEST_GAP = 3  # frames that an object may be missed in
_NEW_SHARE = 0.3  # of the newest step in the mean step of a box
_SIDES = ("left_px", "top_px", "right_px", "bottom_px")


@dataclass(frozen=True, slots=True, eq=False)
class BoxTable:
    """The boxes of a recording as columns, in order of the frames.

    Attributes:
        times_ns: (f,) stamps of the annotated frames.
        frames: (b,) which of them each box is in.
        boxes_px: (b, 4) left, top, right, bottom.
        labels: (b,) the classes.
        tracks: (b,) equal numbers are one object in several frames.
        names: (b,) what their source calls the objects; "" if it does not follow them.
    """

    times_ns: TimesNs
    frames: Indices
    boxes_px: np.ndarray
    labels: tuple[str, ...]
    tracks: Indices
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        count = len(self.labels)
        object.__setattr__(self, "times_ns", frozen_array(self.times_ns, (None,), dtype=np.int64))
        object.__setattr__(self, "boxes_px", frozen_array(self.boxes_px, (count, 4)))
        for name in ("frames", "tracks"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (count,), dtype=np.int64))


def box_table(boxes: Boxes) -> BoxTable:
    """Lay boxes out as columns, and follow the objects whose source does not.

    Args:
        boxes: with the tracks of their source where it states them; other boxes are linked by how they move.
    """
    frames = np.array([i for i, frame in enumerate(boxes) for _ in frame.boxes], dtype=np.int64)
    every = [box for frame in boxes for box in frame.boxes]
    sides = np.array([[getattr(box, side) for side in _SIDES] for box in every]).reshape(-1, 4)
    labels, names = tuple(box.label for box in every), tuple(box.track for box in every)
    return BoxTable(boxes.times_ns, frames, sides, labels, _tracks(frames, every, sides), names)


@dataclass(slots=True)
class _Object:
    """An object while it is followed: its last box, and how that moves per frame."""

    row: int
    frame: int
    step_px: np.ndarray

    def expected(self, sides: np.ndarray, frame: int) -> np.ndarray:
        """Return where its box (4,) would be in a later frame."""
        return np.asarray(sides[self.row] + self.step_px * (frame - self.frame))

    def seen(self, row: int, sides: np.ndarray, frame: int) -> None:
        """Take its box of a later frame."""
        step_px = (sides[row] - sides[self.row]) / (frame - self.frame)
        self.step_px = (1.0 - _NEW_SHARE) * self.step_px + _NEW_SHARE * step_px
        self.row, self.frame = row, frame


def _tracks(frames: Indices, every: list[Box], sides: np.ndarray) -> Indices:
    """Return the number of the object of each box (b,)."""
    named = {name: number for number, name in enumerate(dict.fromkeys(box.track for box in every if box.track))}
    tracks = np.array([named.get(box.track, -1) for box in every], dtype=np.int64)
    count = len(named)
    followed: list[_Object] = []
    unnamed = np.flatnonzero(tracks < 0)
    starts = np.flatnonzero(np.diff(frames[unnamed], prepend=-1))
    for rows in np.split(unnamed, starts)[1:]:
        frame = int(frames[rows[0]])
        followed = [one for one in followed if frame - one.frame <= _LONGEST_GAP]
        linked = _linked(followed, rows.tolist(), frame, every, sides)
        for row in rows.tolist():
            known = linked.get(row)
            if known is None:
                followed.append(_Object(row, frame, np.zeros(4)))
                tracks[row], count = count, count + 1
            else:
                tracks[row] = tracks[known.row]
                known.seen(row, sides, frame)
    return tracks


def _linked(
    followed: list[_Object], now: list[int], frame: int, every: list[Box], sides: np.ndarray
) -> dict[int, _Object]:
    """Return for boxes of this frame the object that they continue: the nearest to where it is expected."""
    if not followed:
        return {}
    steps = _steps(np.array([one.expected(sides, frame) for one in followed]), sides[now])
    same = np.array([[every[one.row].label == every[row].label for row in now] for one in followed])
    steps = np.where(same, steps, np.inf)
    linked: dict[int, _Object] = {}
    taken: set[int] = set()
    for flat in np.argsort(steps, axis=None, kind="stable").tolist():
        i, j = divmod(flat, len(now))
        if steps[i, j] > _LONGEST_STEP:
            break
        if i not in taken and now[j] not in linked:
            linked[now[j]] = followed[i]
            taken.add(i)
    return linked


def _steps(expected: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return how far boxes (b, 4) are from expected ones (a, 4), in widths and heights, sizes included: (a, b)."""
    size = np.maximum(
        np.maximum((expected[:, 2:] - expected[:, :2])[:, None], (found[:, 2:] - found[:, :2])[None]), 1.0
    )
    apart = (found[None] - expected[:, None]).reshape(len(expected), len(found), 2, 2)
    return np.asarray(np.sqrt(((apart / size[:, :, None]) ** 2).sum(axis=3).mean(axis=2)))
