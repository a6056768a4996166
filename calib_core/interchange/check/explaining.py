"""Findings of a check, and the slip that explains why a pose misses what it should meet."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from calib_core.geometry import RigidTransform
from calib_core.interchange.check.mistakes import Suspicion, suspicions
from calib_core.interchange.imported import WrittenPose

__all__ = ["Finding", "explained", "explaining"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing a check found.

    Attributes:
        level: "good" (verified), "caution" (look at it) or "error" (the file is wrong).
        code: one word for programs.
        message: what was found, with figures.
        hint: what to do about it; empty when nothing needs doing.
    """

    level: Literal["good", "caution", "error"]
    code: str
    message: str
    hint: str = ""


def explaining(pose: WrittenPose, miss: Callable[[RigidTransform], float], limit: float) -> Suspicion | None:
    """Return the fewest slips that bring the miss under the limit; of equally few, the best."""
    best: tuple[int, float, Suspicion] | None = None
    for suspicion in suspicions(pose):
        try:
            missed = miss(suspicion.pose.camera_from_radar())
        except ValueError:
            continue
        rank = (len(suspicion.mistakes), missed)
        if missed <= limit and (best is None or rank < best[:2]):
            best = (*rank, suspicion)
    return best[2] if best else None


def explained(suspicion: Suspicion, before: str) -> Finding:
    """Return the finding that names the slips.

    Args:
        suspicion: the slips.
        before: what was missed, to stand before the colon.
    """
    mistakes = suspicion.mistakes
    return Finding(
        "error",
        "+".join(mistake.code for mistake in mistakes),
        f"{before}: " + ", and ".join(mistake.message for mistake in mistakes),
        ", and ".join(mistake.hint for mistake in mistakes),
    )
