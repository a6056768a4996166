"""A calibration in a few lines of text, for the command line: the same figures as on the page."""

from app.view.figures import metric_figures, pose_figures
from app.view.model import Figure
from app.view.number_format import plain
from app.view.wording import sentence
from calib_core.results import Calibration

__all__ = ["summary_lines"]


def summary_lines(calibration: Calibration) -> tuple[str, ...]:
    """Return the figures, one per line and aligned, then the pairs that disagree and the warnings."""
    figures = (*metric_figures(calibration), *pose_figures(calibration))
    width = max(len(figure.label) for figure in figures)
    lines = [_line(figure, width) for figure in figures]
    lines += [
        f"disagrees: {pair.id}: {plain(pair.distance_px)} px from its radar position"
        for pair in calibration.pairs
        if not pair.inlier and not pair.excluded
    ]
    lines += [f"warning: {sentence(warning.message)} {sentence(warning.hint)}" for warning in calibration.warnings]
    lines += [f"unpaired: {row.id}: {sentence(row.reason)} {sentence(row.hint)}" for row in calibration.unpaired]
    return tuple(lines)


def _line(figure: Figure, width: int) -> str:
    return f"{figure.label:<{width}}  {figure.value} {figure.unit}".rstrip()
