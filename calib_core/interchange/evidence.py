"""What a pose in a file rests on: clicks, an import that was proven, or an import whose meaning was assumed."""

from typing import Literal, TypeAlias, get_args

__all__ = ["EVIDENCE_LEVELS", "Evidence", "stated_evidence"]

Evidence: TypeAlias = Literal["clicked", "imported_proven", "imported_assumed"]
"""Solved from clicks; read from another tool's file whose meaning a check point, pairs or another calibration proved; read from
one whose meaning was assumed. Reading a file never raises the level it states."""

EVIDENCE_LEVELS: tuple[Evidence, ...] = get_args(Evidence)
"""From the strongest to the weakest."""


def stated_evidence(text: str) -> Evidence:
    """Return the level that a file states; the weakest if it is none of ours, such as one of a later version."""
    return next((level for level in EVIDENCE_LEVELS if level == text), EVIDENCE_LEVELS[-1])
