"""What a pose in a file rests on: clicks of a person, clicks that nobody confirmed, or an import, proven or assumed."""

from typing import Literal, TypeAlias, get_args

Evidence: TypeAlias = Literal["clicked", "imported_proven", "imported_assumed", "automatic"]
"""Solved from clicks; read from another tool's file whose meaning a check point, pairs or another calibration proved; read from
one whose meaning was assumed; solved from clicks of which some or all were placed automatically, and nobody confirmed them.
Reading a file never raises the level it states."""

EVIDENCE_LEVELS: tuple[Evidence, ...] = get_args(Evidence)
"""All of them; files that hold only numbers state the position in this list, so new ones go to the end."""
_UNKNOWN: Evidence = "imported_assumed"


def stated_evidence(text: str) -> Evidence:
    """Return the level that a file states; the weakest if it is none of ours, such as one of a later version."""
    return next((level for level in EVIDENCE_LEVELS if level == text), _UNKNOWN)
