"""What the page says about a recording that is still being written: how far behind it is, and the best next placement."""

from dataclasses import dataclass
from typing import Literal

from calib_core.diagnostics.next_placement import ENOUGH_PLACEMENTS, Coverage
from calib_core.results import NextPlacement
from calib_core.words.verdict import placement_words

FollowState = Literal["live", "quiet", "complete", "ended"]

_SLOW_S = 1.0
_SIDES = {"left": "to the left", "ahead": "straight ahead", "right": "to the right"}


@dataclass(frozen=True, slots=True)
class Pace:
    """How the recording grows.

    Attributes:
        state: "live" while it grows, "quiet" when nothing has been written for a while, "complete" once the writer has closed
            it, "ended" if it can no longer be followed.
        quiet_s: since something was written last [s].
        every_s: between two additions to the file [s]; None until there are some.
        age_s: of the newest frame by its stamp when it was read [s]; None if its stamp does not fit this machine's clock.
        problem: why it can no longer be followed; "" if it can.
    """

    state: FollowState
    quiet_s: float = 0.0
    every_s: float | None = None
    age_s: float | None = None
    problem: str = ""


def pace_words(pace: Pace) -> str:
    """Say how far behind the recording the page is, in one or two sentences."""
    if pace.state == "ended":
        return pace.problem
    if pace.state == "complete":
        return "The recording is complete."
    if pace.state == "quiet":
        return (
            f"Nothing has been written for {pace.quiet_s:.0f} s: the recorder has stopped or pauses. "
            "What it has written is kept."
        )
    age = "" if pace.age_s is None else f": the newest frame was {pace.age_s:.1f} s old when it arrived"
    slow = pace.every_s is not None and pace.every_s > _SLOW_S
    return f"Following{age}{f'; the recorder writes every {pace.every_s:.1f} s' if slow else ''}."


def advice_words(coverage: Coverage, best: NextPlacement | None) -> str:
    """Say how many placements there are and where the next one helps most, in one sentence.

    Args:
        coverage: of the placements that the radar shows.
        best: from the calibration; None without one.
    """
    if best is not None and best.may_stop:
        return f"{_count(coverage.placements)}: further ones would not help noticeably."
    if best is not None:
        return f"{_count(coverage.placements)}; next: {placement_words(*best.position_radar_m[:2].tolist())}."
    if coverage.next is not None:
        total = f"{coverage.placements} of {ENOUGH_PLACEMENTS} placements"
        few = total if coverage.placements < ENOUGH_PLACEMENTS else _count(coverage.placements)
        where = f"{_SIDES[coverage.next.side]}, {coverage.next.near_m:g} to {coverage.next.far_m:g} m away"
        return f"{few}; next: {where}{_height(coverage)}."
    return (
        f"{_count(coverage.placements)}, near and far and on both sides: enough for a calibration{_height(coverage)}."
    )


def _count(placements: int) -> str:
    return f"{placements} placement{'' if placements == 1 else 's'}"


def _height(coverage: Coverage) -> str:
    return ", on a box: all are at one height" if coverage.one_height else ""
