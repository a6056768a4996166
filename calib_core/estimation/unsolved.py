"""The outcomes of a solve without an answer: what is missing, with figures, and what to do."""

from calib_core.measurements import MIN_PAIRS, Unsolvable

DEGENERATE = "degenerate-placements"
"""The code of placements that leave part of the pose open."""


def too_few(used: int, excluded: int, unpaired: int, untouched: int = 0) -> Unsolvable:
    """Fewer pairs than a pose needs."""
    kinds = ((excluded, "excluded"), (unpaired, "unpaired"), (untouched, "untouched"))
    others = "".join(f", {count} {what}" for count, what in kinds if count)
    return Unsolvable(
        "too-few-pairs",
        f"{used} of at least {MIN_PAIRS} required pairs{others}",
        "click the reflector at more placements: ten or more, near and far, spread over the picture",
    )


def mirrored(reason: str) -> Unsolvable:
    """Mirrored axes would fit."""
    return Unsolvable(
        "mirrored-axes",
        f"{reason}; with one radar axis mirrored they fit better",
        "radar axes must be x forward, y left, z up: flip the sign of y (or of the elevation) at the source",
    )


def degenerate(count: int) -> Unsolvable:
    """The placements leave part of the pose open."""
    return Unsolvable(
        DEGENERATE,
        f"the {count} placements do not determine the pose: they lie at one place or on one line",
        "spread the placements: near and far, left and right",
    )


def one_place(clicks: int, placements: int) -> Unsolvable:
    """Most clicks show the same placement."""
    return Unsolvable(
        DEGENERATE,
        f"the {clicks} clicks show {placements} of at least {MIN_PAIRS} required placements: clicks of one placement count "
        "as one",
        "move the reflector between clicks: near and far, left and right",
    )


def no_pose(reason: str) -> Unsolvable:
    """The pairs disagree."""
    return Unsolvable(
        "no-pose",
        reason,
        "check that clicks and radar data are from the same times, that the intrinsics belong to this camera at this "
        "image size, and that the placements are spread over the picture",
    )
