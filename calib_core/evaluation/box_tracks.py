"""Box tracks: which boxes of successive frames are around one object, as their source says, or by how they overlap."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, TimesNs, frozen_array
from calib_core.detections import Box, Boxes

__all__ = ["BoxTable", "box_table"]

_LEAST_OVERLAP = 0.25  # intersection over union of two boxes of one object in successive frames
_LONGEST_GAP = 3  # frames that an object may be missed in
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
        boxes: with the tracks of their source where it states them; other boxes are linked by their overlap.
    """
    frames = np.array([i for i, frame in enumerate(boxes) for _ in frame.boxes], dtype=np.int64)
    every = [box for frame in boxes for box in frame.boxes]
    sides = np.array([[getattr(box, side) for side in _SIDES] for box in every]).reshape(-1, 4)
    labels, names = tuple(box.label for box in every), tuple(box.track for box in every)
    return BoxTable(boxes.times_ns, frames, sides, labels, _tracks(frames, every, sides), names)


def _tracks(frames: Indices, every: list[Box], sides: np.ndarray) -> Indices:
    """Return the number of the object of each box (b,)."""
    named = {name: number for number, name in enumerate(dict.fromkeys(box.track for box in every if box.track))}
    tracks = np.array([named.get(box.track, -1) for box in every], dtype=np.int64)
    count = len(named)
    open_rows: list[int] = []  # the last boxes of the objects that are followed
    unnamed = np.flatnonzero(tracks < 0)
    for frame in np.unique(frames[unnamed]).tolist():
        rows = _rows_of(frames, unnamed, frame)
        open_rows = [row for row in open_rows if frame - frames[row] <= _LONGEST_GAP]
        linked = _linked(open_rows, rows.tolist(), every, sides)
        for row in rows.tolist():
            before = linked.get(row)
            tracks[row] = count if before is None else tracks[before]
            count += before is None
        continued = set(linked.values())
        open_rows = [row for row in open_rows if row not in continued] + rows.tolist()
    return tracks


def _rows_of(frames: Indices, unnamed: Indices, frame: int) -> Indices:
    low, high = np.searchsorted(frames[unnamed], (frame, frame + 1))
    return np.asarray(unnamed[low:high])


def _linked(before: list[int], now: list[int], every: list[Box], sides: np.ndarray) -> dict[int, int]:
    """Return for boxes of this frame the box that they continue, the largest overlaps first."""
    if not before:
        return {}
    overlap = _overlap(sides[before], sides[now])
    same = np.array([[every[a].label == every[b].label for b in now] for a in before])
    overlap = np.where(same, overlap, 0.0)
    linked: dict[int, int] = {}
    for flat in np.argsort(-overlap, axis=None, kind="stable").tolist():
        i, j = divmod(flat, len(now))
        if overlap[i, j] < _LEAST_OVERLAP:
            break
        if before[i] not in linked.values() and now[j] not in linked:
            linked[now[j]] = before[i]
    return linked


def _overlap(some: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the intersection over union (a, b) of boxes (a, 4) and (b, 4)."""
    low = np.maximum(some[:, None, :2], others[None, :, :2])
    high = np.minimum(some[:, None, 2:], others[None, :, 2:])
    both = np.prod(np.maximum(high - low, 0.0), axis=2)
    areas = [np.prod(one[:, 2:] - one[:, :2], axis=1) for one in (some, others)]
    union = areas[0][:, None] + areas[1][None] - both
    return np.asarray(both / np.where(union > 0, union, 1.0))
