"""Findings of a check, and the slip that explains why a pose misses what it should meet."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from calib_core.geometry import RigidTransform
from calib_core.interchange.check.slips import SuspectedSlips, suspected_slips
from calib_core.interchange.imported import WrittenPose

__all__ = ["CheckResult", "explain", "explained"]


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One thing a check found.

    Attributes:
        level: "good" (verified), "warning" (look at it) or "error" (the file is wrong).
        code: one word for programs.
        message: what was found, with figures.
        hint: what to do about it; empty when nothing needs doing.
    """

    level: Literal["good", "warning", "error"]
    code: str
    message: str
    hint: str = ""


def explain(pose: WrittenPose, miss: Callable[[RigidTransform], float], limit: float) -> SuspectedSlips | None:
    """Return the fewest slips that bring the miss under the limit; of equally few, the best."""
    best: tuple[int, float, SuspectedSlips] | None = None
    for suspected in suspected_slips(pose):
        try:
            missed = miss(suspected.pose.camera_from_radar())
        except ValueError:
            continue
        rank = (len(suspected.slips), missed)
        if missed <= limit and (best is None or rank < best[:2]):
            best = (*rank, suspected)
    return best[2] if best else None


def explained(suspected: SuspectedSlips, before: str) -> CheckResult:
    """Return the result that names the slips.

    Args:
        suspected: the slips.
        before: what was missed, to stand before the colon.
    """
    slips = suspected.slips
    return CheckResult(
        "error",
        "+".join(slip.code for slip in slips),
        f"{before}: " + ", and ".join(slip.message for slip in slips),
        ", and ".join(slip.hint for slip in slips),
    )
