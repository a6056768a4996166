"""The errors that all pairs share, as a table under the pose, and what the largest of them means."""

from collections.abc import Sequence

from calib_core.results import Calibration
from calib_core.results.systematic_errors import SystematicErrorResult, error_words, is_determined
from cocalib.view.model import Figure, Level, SystematicErrorRow, SystematicErrorTable
from cocalib.view.wording import plain, sentence, with_sigma

_SHOWN_SHARE = 0.03
_DOMINANT_SHARE = 1.0 / 3.0


def uncertainty_sentences(calibration: Calibration) -> tuple[str, ...]:
    """Say which errors make up a third or more of the uncertainty, and what would reduce them; empty if none does."""
    return tuple(sentence(one.sentence) for one in calibration.dominant_errors())


def refined_sentences(calibration: Calibration) -> tuple[str, ...]:
    """Say by how much refining changed the intrinsics; empty if they were not refined."""
    refined = [
        one
        for one in calibration.systematic_errors
        if one.estimated and one.of_lens and (is_determined(one) or abs(one.value) >= one.prior_sigma > 0.0)
    ]
    if calibration.given_camera is None:
        return ()
    parts = []
    for one in refined:
        words = error_words(one.name)
        amount = with_sigma(words.factor * one.value, words.factor * one.sigma)
        parts.append(f"{words.label} by {amount} {words.unit}".rstrip())
    changed = "; ".join(parts) or "the pairs say nothing about them"
    return (sentence(f"the intrinsics were refined with the pose: {changed}"),)


def systematic_errors(calibration: Calibration) -> SystematicErrorTable:
    """Return the table: errors that the pairs determine or that matter, the largest share first."""
    groups = sorted(_groups(calibration.errors_of_firm), key=_largest_share, reverse=True)
    shown = [group for group in groups if _largest_share(group) >= _SHOWN_SHARE or is_determined(group[0])]
    rest = len(groups) - len(shown)
    note = f"{rest} more: the pairs do not determine them, and each has less than 3 % of the variance." if rest else ""
    sentences = (*uncertainty_sentences(calibration), *refined_sentences(calibration))
    return SystematicErrorTable(tuple(map(_row, shown)), note, sentences)


def _groups(errors: Sequence[SystematicErrorResult]) -> list[list[SystematicErrorResult]]:
    """Put errors of several axes that the pairs do not determine together; every other error stands alone."""
    groups: dict[str, list[SystematicErrorResult]] = {}
    for one in errors:
        family = "".join(error_words(one.name).family)
        groups.setdefault(one.name if is_determined(one) or not family else family, []).append(one)
    return list(groups.values())


def _shares(group: Sequence[SystematicErrorResult]) -> tuple[float, float]:
    return sum(one.position_share for one in group), sum(one.rotation_share for one in group)


def _largest_share(group: Sequence[SystematicErrorResult]) -> float:
    return max(_shares(group))


def _row(group: Sequence[SystematicErrorResult]) -> SystematicErrorRow:
    one, (position, rotation) = group[0], _shares(group)
    words = error_words(one.name)
    label = words.family[0] if len(group) > 1 and words.family else words.label
    known = "Estimated with the pose." if one.estimated else "Not taken out of the pose, but part of its uncertainty."
    value = with_sigma(words.factor * one.value, words.factor * one.sigma) if is_determined(one) else "–"
    hint = " ".join((*(sentence(error_words(each.name).text) for each in group), known, sentence(words.remedy)))
    level: Level = "warning" if max(position, rotation) >= _DOMINANT_SHARE else "plain"
    return SystematicErrorRow(
        Figure(one.name, label, value, words.unit, hint, level),
        prior=f"± {plain(words.factor * one.prior_sigma, 2)}",
        position_percent=round(100.0 * position),
        rotation_percent=round(100.0 * rotation),
    )
