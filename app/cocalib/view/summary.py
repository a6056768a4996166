"""A calibration in a few lines of text, for the command line: the same figures as on the page."""

from dataclasses import replace

from calib_core.diagnostics.consequence import by_consequence
from calib_core.results import Calibration
from calib_core.verdict import verdict_on
from cocalib.view.figure import Figure
from cocalib.view.figures import assumed_figures, metric_figures, pose_figures
from cocalib.view.number_format import plain
from cocalib.view.systematic_errors import refined_sentences, uncertainty_sentences
from cocalib.view.wording import sentence

_PAPER_NAMES = {"aed": "AED", "held_out_aed": "held-out AED", "cdsd": "CDSD", "rms": "RMS"}
"""In text there is no hover to say what a figure is called in the paper."""


def summary_lines(calibration: Calibration) -> tuple[str, ...]:
    """Return the verdict, the figures, aligned, then what they rest on, the pairs that disagree and the warnings, gravest first.

    For a radar without elevation what it determines comes first, and what it does not follows in one line.
    """
    metrics, pose, assumed = metric_figures(calibration), pose_figures(calibration), assumed_figures(calibration)
    figures = (*pose, *metrics) if assumed else (*metrics, *pose)
    figures = tuple(replace(one, label=_PAPER_NAMES.get(one.key, one.label)) for one in figures)
    width = max(len(figure.label) for figure in figures)
    verdict = verdict_on(calibration)
    head = (f"verdict: {verdict.line}", f"next: {sentence(verdict.action)}")
    lines = [_line(figure, width) for figure in figures]
    if assumed:
        parts = ", ".join(f"{figure.label} {figure.value} {figure.unit}" for figure in assumed)
        lines.insert(len(pose), f"assumed, because this radar measures no elevation: {parts}")
    lines += [f"uncertainty: {line}" for line in uncertainty_sentences(calibration)]
    lines += [f"intrinsics: {line}" for line in refined_sentences(calibration)]
    lines += [
        f"disagrees: {pair.id}: {plain(pair.distance_px)} px from its radar position"
        for pair in calibration.pairs
        if not pair.inlier and not pair.excluded
    ]
    lines += [
        f"warning: {sentence(warning.message)} {sentence(warning.hint)}"
        for warning in by_consequence(calibration.warnings)
    ]
    lines += [f"unpaired: {row.id}: {sentence(row.reason)} {sentence(row.hint)}" for row in calibration.unpaired]
    return (*head, *lines)


def _line(figure: Figure, width: int) -> str:
    return f"{figure.label:<{width}}  {figure.value} {figure.unit}".rstrip()
