"""What the page's line says while pairs are few or placements are left, and where one more placement would help."""

from calib_core.measurements import MIN_PAIRS
from calib_core.results import NextPlacement
from calib_core.results.verdict import SURE_PAIRS, StatedError
from calib_core.words.text import Words, listed, say, words
from calib_core.words.verdict import error_text, placement_words

NO_CLICKS = words("No clicks yet")
NO_ANSWER = words("No answer yet")
MISFIT_OF_FEW = words(f"One of the {MIN_PAIRS} does not fit")
RETURN_OPEN = words("a return is open")
TWO_ANSWERS = words("two answers fit so far")
CONSISTENT = words("looks consistent")


def check(pair: Words) -> Words:
    """Ask for a look at a pair."""
    return "check " + pair


def few_pairs(agreeing: int, what: Words | None = None) -> Words:
    """Return how many pairs there are of those that a verdict needs, and what is to be said of them."""
    return f"{agreeing} of {SURE_PAIRS} pairs" + ("; " + what if what else words(""))


def many_left(pairs: int, error: StatedError | None, what: Words | None = None) -> Words:
    """Return how many pairs there are, what is to be said of them, and how large the error still is."""
    said = "; " + what if what else words(" agree")
    return f"{pairs} pairs" + said + f"; so far within {error_text(error) if error else ''}"


def misfits_of(ids: list[str]) -> Words:
    """Return that these pairs do not fit; nothing without any."""
    return say("{ids} {do} not fit", ids=listed(ids), do="do" if ids[1:] else "does") if ids else Words()


def mark_question(pair: Words) -> Words:
    """Ask about the mark of a pair."""
    return say("Is the mark of {pair} on the inner corner?", pair=pair)


_NOTICEABLE = 0.05
"""A placement that reduces the uncertainty by less is said to do so slightly."""


def next_placement_words(best: NextPlacement) -> str:
    """Return where a placement would help most."""
    if best.may_stop:
        return "Further placements would not help noticeably."
    amount = f"{100 * (1 - 1 / best.gain):.0f} %" if best.gain > 1 + _NOTICEABLE else "slightly"
    return f"One more placement {placement_words(*best.position_radar_m[:2].tolist())}: {amount} less uncertainty."
