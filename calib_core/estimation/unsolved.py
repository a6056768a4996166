"""The outcomes of a solve without an answer; `calib_core.words.unsolvable` says them."""

from calib_core.measurements import MIN_PAIRS, Unsolvable

DEGENERATE = "degenerate-placements"
"""The code of placements that leave part of the pose open."""


def too_few(used: int, excluded: int, unpaired: int, untouched: int = 0) -> Unsolvable:
    """Fewer pairs than a pose needs."""
    facts = {"used": used, "needed": MIN_PAIRS, "excluded": excluded, "unpaired": unpaired, "untouched": untouched}
    return Unsolvable("too-few-pairs", facts)


def degenerate(count: int) -> Unsolvable:
    """The placements leave part of the pose open."""
    return Unsolvable(DEGENERATE, {"placements": count})


def one_place(clicks: int, placements: int) -> Unsolvable:
    """Most clicks show the same placement."""
    return Unsolvable(DEGENERATE, {"placements": placements, "clicks": clicks, "needed": MIN_PAIRS})


def disagreeing(agreeing: int, pairs: int, *, mirrored: bool) -> Unsolvable:
    """The pairs disagree; with one radar axis mirrored they may fit better."""
    return Unsolvable("mirrored-axes" if mirrored else "no-pose", {"agreeing": agreeing, "pairs": pairs})
