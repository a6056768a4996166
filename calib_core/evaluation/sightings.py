"""Sightings: what the radar sees of each moving target in each annotated frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, TimesNs, Values, frozen_array
from calib_core.errors import InputError
from calib_core.evaluation.target_tracking import TargetTrack
from calib_core.measurements import NS_PER_S, RadarScans, ReturnLabels


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """The returns of targets in the scans that belong to annotated frames, in order of frames, then targets.

    Attributes:
        names: of the targets.
        frames: (s,) frame of each sighting.
        targets: (s,) index of its target.
        azimuth_rad: (s,) of the mean of its returns.
        range_m: (s,) likewise.
        of_return: (n,) the sighting of each return, ascending.
        points_radar_m: (n, 3) the returns.
    """

    names: tuple[str, ...]
    frames: Indices
    targets: Indices
    azimuth_rad: Values
    range_m: Values
    of_return: Indices
    points_radar_m: Points3

    def __post_init__(self) -> None:
        for name in ("frames", "targets", "of_return"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (None,), dtype=np.int64))
        for name in ("azimuth_rad", "range_m"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (len(self.frames),)))
        object.__setattr__(self, "points_radar_m", frozen_array(self.points_radar_m, (len(self.of_return), 3)))

    def some(self, kept: Flags) -> "Sightings":
        """Keep the sightings of these flags (s,) with their returns."""
        number = np.cumsum(kept) - 1
        rows = kept[self.of_return]
        return Sightings(
            self.names,
            self.frames[kept],
            self.targets[kept],
            self.azimuth_rad[kept],
            self.range_m[kept],
            number[self.of_return[rows]],
            self.points_radar_m[rows],
        )


def tracked_sightings(targets: Sequence[TargetTrack], scans_of_frames: Indices) -> Sightings:
    """Collect the returns of followed targets at the annotated frames.

    Args:
        targets: what the radar followed.
        scans_of_frames: (f,) the scan of each frame; -1 for none.
    """
    none = np.zeros(0, dtype=np.int64)
    scans = np.concatenate([none, *(one.scan_of_row for one in targets)])
    owner = np.repeat(np.arange(len(targets)), [len(one.rows) for one in targets])
    points = np.concatenate([np.zeros((0, 3)), *(one.points_radar_m for one in targets)])
    order = np.argsort(scans, kind="stable")
    low, high = (np.searchsorted(scans[order], scans_of_frames, side=side) for side in ("left", "right"))
    counts = np.where(scans_of_frames >= 0, high - low, 0)
    frames = np.repeat(np.arange(len(scans_of_frames)), counts)
    within = np.arange(len(frames)) - np.repeat(np.cumsum(counts) - counts, counts)
    rows = order[np.repeat(low, counts) + within]
    return _sightings(tuple(one.id for one in targets), frames, owner[rows], points[rows])


def labelled_sightings(
    scans: RadarScans, labels: ReturnLabels, image_times: TimesNs, scans_of_frames: Indices
) -> Sightings:
    """Collect the returns that labels give to objects, at the annotated frames.

    Args:
        scans: those around the frames.
        labels: of scans of the same recording.
        image_times: (f,) stamps of the frames, for messages.
        scans_of_frames: (f,) the scan of each frame; -1 for none.

    Raises:
        InputError: a scan has no labels, or another number of returns than they have.
    """
    known = {int(scan.radar_time): scan.tracks for scan in labels.scans}
    numbers: dict[str, int] = {}
    frames: list[int] = []
    owner: list[int] = []
    points = [np.zeros((0, 3))]
    for frame, scan in enumerate(scans_of_frames.tolist()):
        if scan < 0:
            continue
        tracks = _tracks_of(scans, scan, known, labels.source, int(image_times[frame]))
        own = [row for row, track in enumerate(tracks) if track]
        frames += [frame] * len(own)
        owner += [numbers.setdefault(tracks[row], len(numbers)) for row in own]
        points.append(scans.points_radar_m[int(scans.first_return[scan]) + np.array(own, dtype=np.int64)])
    owners = np.array(owner, dtype=np.int64)
    return _sightings(tuple(numbers), np.array(frames, dtype=np.int64), owners, np.concatenate(points))


def _tracks_of(
    scans: RadarScans, scan: int, known: dict[int, tuple[str, ...]], source: str, image_time: int
) -> tuple[str, ...]:
    """Return the labels of a scan's returns.

    Raises:
        InputError: there are none, or another number.
    """
    time = int(scans.times_ns[scan])
    tracks = known.get(time)
    count = int(scans.first_return[scan + 1] - scans.first_return[scan])
    if tracks is None:
        raise InputError(
            f"{source}: has no labels for the scan at {time / NS_PER_S:.3f} s, which belongs to the frame at "
            f"{image_time / NS_PER_S:.3f} s; give the labels of this recording"
        )
    if len(tracks) != count:
        raise InputError(
            f"{source}: labels {len(tracks)} returns of the scan at {time / NS_PER_S:.3f} s, which has {count}; give the labels "
            "of this recording, read with the same options"
        )
    return tracks


def _sightings(names: tuple[str, ...], frames: Indices, targets: Indices, points: Points3) -> Sightings:
    finite = np.isfinite(points).all(axis=1)
    frames, targets, points = frames[finite], targets[finite], points[finite]
    order = np.lexsort((targets, frames))
    frames, targets, points = frames[order], targets[order], points[order]
    keys = frames * max(len(names), 1) + targets
    first, of_return = np.unique(keys, return_index=True, return_inverse=True)[1:]
    sizes = np.maximum(np.bincount(of_return, minlength=len(first)), 1)
    means = np.stack(
        [np.bincount(of_return, weights=axis, minlength=len(first)) / sizes for axis in points.T], axis=1
    ).reshape(-1, 3)
    azimuth, range_m = np.arctan2(means[:, 1], means[:, 0]), np.linalg.norm(means, axis=1)
    return Sightings(names, frames[first], targets[first], azimuth, range_m, of_return, points)
