"""Counted returns: what Acc is computed from, the same for every calibration that is judged."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Points3, TimesNs, frozen_array
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.evaluation.matching import Bearings, box_table, match_by_bearing, match_by_name
from calib_core.evaluation.sightings import labelled_sightings, tracked_sightings
from calib_core.evaluation.target_tracking import TargetTrack
from calib_core.measurements import NS_PER_S, Boxes, RadarScans, ReturnLabels


@dataclass(frozen=True, slots=True, eq=False)
class CountedReturns:
    """The returns of targets in the annotated frames, with the boxes of those targets.

    Attributes:
        image_times: (f,) stamps of the frames that have a scan.
        radar_times: (f,) stamps of those scans.
        box_counts: (f,) number of boxes in each.
        frames: (n,) the frame of each return, ascending.
        points_radar_m: (n, 3) as the radar reports them.
        boxes_px: (n, 4) left, top, right, bottom of its target's box; NaN without one.
        labels: (n,) the class of that box; "" without one.
        targets: (n,) names of the targets.
        found_targets: number of targets in these frames.
        matched_targets: number of those that have a box in at least one frame.
        bearings: how the two sensors see the same target; None if nothing shows it.
        rule: which returns count and how they were matched, in one sentence.
        source: of the boxes.
    """

    image_times: TimesNs
    radar_times: TimesNs
    box_counts: Indices
    frames: Indices
    points_radar_m: Points3
    boxes_px: np.ndarray
    labels: tuple[str, ...]
    targets: tuple[str, ...]
    found_targets: int
    matched_targets: int
    bearings: Bearings | None
    rule: str
    source: str

    def __post_init__(self) -> None:
        n, count = len(self.labels), len(self.image_times)
        for name in ("image_times", "radar_times", "box_counts"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (count,), dtype=np.int64))
        object.__setattr__(self, "frames", frozen_array(self.frames, (n,), dtype=np.int64))
        object.__setattr__(self, "points_radar_m", frozen_array(self.points_radar_m, (n, 3)))
        object.__setattr__(self, "boxes_px", frozen_array(self.boxes_px, (n, 4)))


def counted_returns(
    camera: Camera,
    scans: RadarScans,
    boxes: Boxes,
    found: Sequence[TargetTrack] | ReturnLabels,
    *,
    classes: Sequence[str] = (),
    max_gap_s: float | None = None,
) -> CountedReturns:
    """Say which returns count and which box each belongs to; no pose enters.

    Args:
        camera: the lens.
        scans: of the recording; followed targets need only their stamps.
        boxes: of the same recording.
        found: the targets that the radar followed, or the true origin of each return, which then decides.
        classes: count only targets whose boxes are of these classes; all if empty.
        max_gap_s: longest time between a frame and its scan; None takes half the period of the scans.

    Raises:
        InputError: no frame has a scan near enough, no class matches, or the labels are of other scans.
    """
    _require_classes(boxes, classes)
    scans_of_frames = frame_scans(boxes.times_ns, scans.times_ns, max_gap_s=max_gap_s)
    _require_common_time(boxes, scans, scans_of_frames, max_gap_s)
    table = box_table(boxes)
    if isinstance(found, ReturnLabels):
        sightings = labelled_sightings(scans, found, boxes.times_ns, scans_of_frames)
        matches = match_by_name(sightings, table, camera)
    else:
        sightings = tracked_sightings(found, scans_of_frames)
        matches = match_by_bearing(sightings, table, camera)
    labels = np.array(["", *table.labels], dtype=object)[matches.boxes + 1]
    wanted = matches.counts & (np.isin(labels, ["", *classes]) if classes else np.ones(len(labels), dtype=np.bool_))
    sides = np.concatenate([np.full((1, 4), np.nan), table.boxes_px])[matches.boxes + 1]
    own = wanted[sightings.of_return]
    of_return = sightings.of_return[own]
    kept = np.flatnonzero(scans_of_frames >= 0)
    number = np.searchsorted(kept, np.arange(len(scans_of_frames)))
    boxed = np.unique(sightings.targets[wanted & (matches.boxes >= 0)])
    return CountedReturns(
        image_times=boxes.times_ns[kept],
        radar_times=scans.times_ns[scans_of_frames[kept]],
        box_counts=np.bincount(table.frames, minlength=len(boxes))[kept],
        frames=number[sightings.frames[of_return]],
        points_radar_m=sightings.points_radar_m[own],
        boxes_px=sides[of_return],
        labels=tuple(labels[of_return].tolist()),
        targets=tuple(sightings.names[target] for target in sightings.targets[of_return].tolist()),
        found_targets=len(np.unique(sightings.targets[wanted])),
        matched_targets=len(boxed),
        bearings=matches.bearings,
        rule=_rule(isinstance(found, ReturnLabels), longest_gap_s(scans.times_ns) if max_gap_s is None else max_gap_s),
        source=boxes.source,
    )


def renamed_classes(boxes: Boxes, names: dict[str, str]) -> Boxes:
    """Return the boxes with classes renamed.

    Args:
        boxes: with the classes of their source.
        names: from the source's class to ours, such as {"pedestrian": "person"}.

    Raises:
        InputError: no box is of a class that is to be renamed.
    """
    for name in names:
        if name not in boxes.labels:
            raise InputError(
                f"{boxes.source}: no box is of the class '{name}' to be renamed; there are: {_listed(boxes)}"
            )
    frames = tuple(
        replace(frame, boxes=tuple(replace(box, label=names.get(box.label, box.label)) for box in frame.boxes))
        for frame in boxes
    )
    return replace(boxes, frames=frames)


def _rule(labelled: bool, gap_s: float) -> str:
    in_time = (
        f"each annotated frame with the scan nearest to it by the recorded stamps, at most {1000.0 * gap_s:.3g} ms away"
    )
    if labelled:
        return f"{in_time}; the labels say which returns belong to which box; those of targets without a box count as outside"
    return (
        f"{in_time}; returns of moving targets that the radar followed over three scans or more; each target has one box "
        "track over its life, chosen by bearing and time without the calibration; returns of targets in view without a box "
        "count as outside"
    )


def _require_classes(boxes: Boxes, classes: Sequence[str]) -> None:
    unknown = [name for name in classes if name not in boxes.labels]
    if unknown:
        raise InputError(
            f"{boxes.source}: no box is of the class '{unknown[0]}'; there are: {_listed(boxes)}; name one of these, or map "
            f"a class to it, as in --class-map pedestrian={unknown[0]}"
        )


def _listed(boxes: Boxes) -> str:
    return ", ".join(f"'{label}'" for label in boxes.labels) or "no boxes at all"


def _require_common_time(boxes: Boxes, scans: RadarScans, scans_of_frames: Indices, max_gap_s: float | None) -> None:
    if not len(boxes):
        raise InputError(f"{boxes.source}: has no annotated frame; give a file with boxes")
    if not len(scans):
        raise InputError(f"{boxes.source}: the recording has no radar scan to judge with")
    if (scans_of_frames >= 0).any():
        return
    first, last = (int(boxes.times_ns[i]) / NS_PER_S for i in (0, -1))
    begin, end = (int(scans.times_ns[i]) / NS_PER_S for i in (0, -1))
    nearest = scans.times_ns[[scans.nearest(frame.image_time) for frame in boxes]]
    gap_s = float(np.abs(nearest - boxes.times_ns).min()) / NS_PER_S
    allowed_s = longest_gap_s(scans.times_ns) if max_gap_s is None else max_gap_s
    raise InputError(
        f"{boxes.source}: no annotated frame is within {allowed_s:.3g} s of a radar scan, the nearest is {gap_s:.3g} s away: the "
        f"frames run from {first:.3f} to {last:.3f} s, the scans from {begin:.3f} to {end:.3f} s; give the boxes of this "
        "recording, or check that both sensors have one clock"
    )


_USUAL_GAP_S = 0.05  # of a single scan


def longest_gap_s(radar_times: TimesNs) -> float:
    """Return half the median period of the scans [s]: a frame farther than this from every scan has none."""
    periods = np.diff(radar_times)
    periods = periods[periods > 0]
    return float(np.median(periods)) / 2.0 / NS_PER_S if len(periods) else _USUAL_GAP_S


def frame_scans(image_times: TimesNs, radar_times: TimesNs, *, max_gap_s: float | None = None) -> Indices:
    """Return the index of the scan that is nearest to each frame (n,), of two equally near the earlier one; -1 for none.

    Args:
        image_times: (n,) stamps of the frames.
        radar_times: (m,) stamps of the scans, ascending.
        max_gap_s: longest time between a frame and its scan; None takes half the period of the scans.
    """
    if not len(radar_times):
        return np.full(len(image_times), -1, dtype=np.int64)
    limit_ns = round((longest_gap_s(radar_times) if max_gap_s is None else max_gap_s) * NS_PER_S)
    after = np.searchsorted(radar_times, image_times)
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, len(radar_times) - 1)
    to_before, to_after = np.abs(image_times - radar_times[before]), np.abs(radar_times[after] - image_times)
    nearest = np.where(to_before <= to_after, before, after)
    return np.asarray(np.where(np.minimum(to_before, to_after) <= limit_ns, nearest, -1))
