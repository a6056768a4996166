"""Results of a check, and the slip that explains a mismatch."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from calib_core.geometry import RigidTransform
from calib_core.interchange.check.slips import UndoneSlips, undone_slips
from calib_core.interchange.imported import WrittenPose


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One result of a check.

    Attributes:
        level: "good" (verified), "warning" (look at it) or "error" (the file is wrong).
        code: one word for programs.
        message: what was found, with figures.
        hint: what to do about it; empty if nothing needs to be done.
    """

    level: Literal["good", "warning", "error"]
    code: str
    message: str
    hint: str = ""


def explain(
    pose: WrittenPose, miss: Callable[[RigidTransform], float], limit: float, *, most: int = 2
) -> UndoneSlips | None:
    """Find the fewest slips that, undone, bring the miss within the limit; among equally few, the best.

    Args:
        pose: as written.
        miss: how far a pose is from the right one, in any unit.
        limit: in the same unit.
        most: how many slips may have happened at once, 1 or 2.
    """
    best: tuple[int, float, UndoneSlips] | None = None
    for undone in undone_slips(pose):
        if len(undone.slips) > most or (best is not None and len(undone.slips) > best[0]):
            break
        try:
            missed = miss(undone.pose.camera_from_radar())
        except ValueError:
            continue
        rank = (len(undone.slips), missed)
        if missed <= limit and (best is None or rank < best[:2]):
            best = (*rank, undone)
    return best[2] if best else None


def explained(undone: UndoneSlips, mismatch: str) -> CheckResult:
    """Return an error result that names the slips.

    Args:
        undone: the slips.
        mismatch: what does not fit, with figures; it starts the message.
    """
    slips = undone.slips
    return CheckResult(
        "error",
        "+".join(slip.code for slip in slips),
        f"{mismatch}: " + ", and ".join(slip.message for slip in slips),
        ", and ".join(slip.hint for slip in slips),
    )
