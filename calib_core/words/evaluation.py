"""What judging a calibration on a recording says: a row for each code of its warnings."""

import numpy as np

from calib_core.measurements import Unpaired
from calib_core.words.remark import Remark, by_code, remark
from calib_core.words.unpaired import unpaired_remark


def boxes_note(*, source: str, note: str) -> Remark:
    return remark(f"{source}: {note}", "check that this is so: boxes of other frames or other objects give a wrong Acc")


def no_doppler(*, assumed: bool) -> Remark:
    still = "; this assumes that the sensors stood still, which nobody said" if assumed else ""
    return remark(
        f"the radar reports no Doppler speeds, so targets count as moving by how far they travel{still}",
        "if the sensors moved, Acc cannot be computed from this recording",
    )


def mostly_moving(*, unfitted: int, scans: int) -> Remark:
    return remark(
        f"nearly all returns move in {unfitted} of {scans} scans, but not as they would if the sensors did: the radar's own "
        "speed cannot be found, and the sensors are taken to stand still",
        "right if the radar leaves out what stands still; if the sensors moved, Acc says nothing here",
    )


def no_paired_clicks(*, clicks: int = 0, first: Unpaired | None = None) -> Remark:
    if first is None:
        return remark("all clicks are excluded or untouched, so there are no residuals", "include clicks")
    why = unpaired_remark(first)
    said = f"none of {clicks} clicks has a radar position, so there are no residuals: " + why.message
    return Remark(said, why.hint, why.action)


def sparse_frames(*, frames: str, apart_s: float, longest_s: float) -> Remark:
    return remark(
        f"{frames} are {apart_s / longest_s:.3g} times farther apart ({apart_s:.3g} s) than targets can be followed, so there is "
        "no Acc",
        "give boxes with cuboids, for which no target is followed, or --labels; or the whole recording in place of its "
        "keyframes, and boxes with a track for each object",
    )


def no_targets(*, max_range_m: float) -> Remark:
    return remark(
        "no moving target was found in the scans of the annotated frames, so there is no Acc",
        f"record people, cars or robots that move within {max_range_m:g} m of the radar, or lower --min-speed-mps; what stands "
        "still has no Doppler speed",
    )


def no_target_in_a_box(*, targets: int | None = None) -> Remark:
    if targets is None:
        return remark(
            "no direction of the camera puts clearly more returns into the cuboids than others do, so there is no Acc",
            "are the cuboids of this recording, in the axes of its camera, and on one clock with the radar?",
        )
    return remark(
        f"none of {targets} moving targets could be matched to a box by bearing and time, so every return counts as outside",
        "are the boxes of this recording, around what moves, and on one clock with the radar?",
    )


_ELSE = {
    "yaw": "the radar's azimuths, or the match of targets and boxes",
    "pitch": "the radar's elevations, or what of an object it sees",
    "roll": "the radar's elevations",
}
_POSITIVE = {"yaw": "to the left", "pitch": "downwards", "roll": "counterclockwise, seen from behind"}


def turned_from_boxes(
    *, axis: str, turned_deg: float, low_deg: float = float("nan"), high_deg: float = float("nan")
) -> Remark:
    ends = f", {low_deg:+.3g} to {high_deg:+.3g} deg with 95 %" if np.isfinite([low_deg, high_deg]).all() else ""
    return remark(
        f"targets and boxes agree best with the calibration's camera turned in {axis} by {turned_deg:+.3g} deg (positive "
        f"{_POSITIVE[axis]}{ends})",
        f"{axis} of the calibration is wrong, or {_ELSE[axis]}; look at the overlay",
    )


WARNINGS = by_code(
    boxes_note,
    mostly_moving,
    no_doppler,
    no_paired_clicks,
    no_target_in_a_box,
    no_targets,
    sparse_frames,
    turned_from_boxes,
)
