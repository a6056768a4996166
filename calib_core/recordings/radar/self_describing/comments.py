"""What comments in a message definition state about directions and about which angle is which."""

import re
from collections.abc import Mapping
from typing import Literal, TypeAlias

Direction: TypeAlias = Literal["forward", "backward", "left", "right", "up", "down"]

_WORDS: Mapping[str, Direction] = {
    "forward": "forward", "forwards": "forward", "ahead": "forward", "front": "forward", "longitudinal": "forward",
    "boresight": "forward", "backward": "backward", "backwards": "backward", "behind": "backward",
    "left": "left", "right": "right", "up": "up", "upward": "up", "upwards": "up", "down": "down", "downward": "down",
    "downwards": "down",
}  # fmt: skip
_OPPOSITE: Mapping[Direction, Direction] = {
    "forward": "backward", "backward": "forward", "left": "right", "right": "left", "up": "down", "down": "up"
}  # fmt: skip
_ANY = "|".join(sorted(_WORDS, key=len, reverse=True))
_BETWEEN = (
    r"(?:\W+(?:is|are|values?|means?|points?|pointing|axis|direction|side|to|towards|the|of|in|on|sensor|angles?))*\W*"
)
_POSITIVE_SIDE = re.compile(rf"(?P<sign>positive|pos\.|negative|neg\.|\+){_BETWEEN}\b(?P<side>{_ANY})\b", re.IGNORECASE)
_SIDE_POSITIVE = re.compile(rf"\b(?P<side>{_ANY})\b{_BETWEEN}(?P<sign>positive|negative|\+)", re.IGNORECASE)
_LEADS_TO = r"(?:\s*(?:is|points?|pointing|=|:|->|to|towards|the|,|-|\(|\+)\s*)*\s*"
_AXIS = re.compile(rf"(?<![\w.])(?P<axis>[xyz])(?:[ -]?axis)?{_LEADS_TO}\b(?P<side>{_ANY})\b", re.IGNORECASE)
_LEFTWARD = re.compile(r"counter-?\s?clockwise|anti-?\s?clockwise|\bccw\b", re.IGNORECASE)
_RIGHTWARD = re.compile(r"(?<!counter)(?<!counter[- ])(?<!anti)(?<!anti[- ])clockwise|\bcw\b", re.IGNORECASE)


def positive_side(comment: str) -> Direction | None:
    """Return the direction in which the values of a field grow, as its comment states it; None if it does not.

    Args:
        comment: such as "azimuth, positive to the left" or "clockwise".
    """
    match = _POSITIVE_SIDE.search(comment) or _SIDE_POSITIVE.search(comment)
    if match:
        side = _WORDS[match["side"].lower()]
        return _OPPOSITE[side] if match["sign"].lower().startswith("neg") else side
    if _LEFTWARD.search(comment):
        return "left"
    return "right" if _RIGHTWARD.search(comment) else None


def axis_side(comment: str) -> Direction | None:
    """Return the direction of an axis that its own comment names alone, such as "forward" or "[m] to the right"."""
    stated = positive_side(comment)
    if stated:
        return stated
    found = {_WORDS[word.lower()] for word in re.findall(rf"\b({_ANY})\b", comment, re.IGNORECASE)}
    return found.pop() if len(found) == 1 else None


def axes_in(remarks: str) -> Mapping[str, Direction]:
    """Return the directions of x, y and z that comments state, such as "x right, y forward, z up".

    Args:
        remarks: the comments of a message or of its elements.
    """
    found: dict[str, Direction] = {}
    for match in _AXIS.finditer(remarks):
        found.setdefault(match["axis"].lower(), _WORDS[match["side"].lower()])
    return found


def angle_in(comment: str) -> Literal["azimuth", "elevation"] | None:
    """Return which angle a comment names; None if none or both."""
    azimuth = re.search(r"azimuth|horizontal|\bbearing\b", comment, re.IGNORECASE)
    elevation = re.search(r"elevation|vertical", comment, re.IGNORECASE)
    if bool(azimuth) == bool(elevation):
        return None
    return "azimuth" if azimuth else "elevation"
