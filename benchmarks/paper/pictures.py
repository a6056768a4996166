"""Figs. 2 to 6 as SVG, drawn by hand: no plotting library is needed, and the same figures give the same bytes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib_core.arrays import Points2
from calib_core.evaluation import BoxFigures
from calib_core.results import Calibration

__all__ = ["histogram", "over_range", "residuals", "write_pictures"]

_STYLE = (
    "<style>text{font:13px sans-serif;fill:#222}.axis{stroke:#444;fill:none}.grid{stroke:#ddd}"
    ".click{stroke:#0072b2;stroke-width:1.6}.at{stroke:#d55e00;fill:none;stroke-width:1.6}.off{stroke:#888}"
    ".bar0{fill:#0072b2}.bar1{fill:#e69f00}.bar2{fill:#009e73}"
    ".middle{text-anchor:middle}.end{text-anchor:end}</style>"
)
_WIDTH, _MARGIN = 640.0, 54.0
_LOW, _TALL = 270.0, 200.0
"""Of the axes of Figs. 5 and 6."""
_FEWEST_RETURNS = 20
"""Below these, the share of a range says nothing."""


def _svg(width: float, height: float, title: str, parts: Sequence[str]) -> str:
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}">'
    ground = f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>'
    return "\n".join([head, _STYLE, ground, f'<text x="10" y="18">{title}</text>', *parts, "</svg>"]) + "\n"


def residuals(calibration: Calibration, title: str) -> str:
    """Draw clicks (crosses), reprojections (rings) and their residuals in the outline of the picture."""
    camera, pairs = calibration.camera, [pair for pair in calibration.pairs if not pair.excluded]
    scale = (_WIDTH - 20.0) / camera.width_px
    height = camera.height_px * scale + 36.0
    frame = f'<rect class="axis" x="10" y="26" width="{_WIDTH - 20.0:.0f}" height="{height - 36.0:.1f}"/>'
    clicks: Points2 = np.array([pair.pixel_px for pair in pairs]) * scale + [10.0, 26.0]
    at: Points2 = np.array([pair.projected_px for pair in pairs]) * scale + [10.0, 26.0]
    parts = [frame]
    for (u, v), (x, y) in zip(clicks, at, strict=True):
        parts.append(f'<path class="click" d="M{u - 4:.1f} {v:.1f}h8M{u:.1f} {v - 4:.1f}v8"/>')
        if np.isfinite([x, y]).all() and -_WIDTH < x < 2 * _WIDTH and -_WIDTH < y < 2 * _WIDTH:
            parts.append(f'<path class="off" d="M{u:.1f} {v:.1f}L{x:.1f} {y:.1f}"/>')
            parts.append(f'<circle class="at" cx="{x:.1f}" cy="{y:.1f}" r="4"/>')
    return _svg(_WIDTH, height, title, parts)


def histogram(figures: Sequence[tuple[str, BoxFigures]], title: str) -> str:
    """Draw the histogram of each frame's Acc, frames of 0 % included, one colour per recording."""
    parts = _axes("returns inside their box [%]", figures)
    step = (_WIDTH - 2 * _MARGIN) / 10.0
    wide = (step - 6.0) / len(figures)
    for k, (_, one) in enumerate(figures):
        count = np.histogram([frame.share for frame in one.frames if frame.returns], np.linspace(0.0, 1.0, 11))[0]
        for b, value in enumerate(count / max(int(count.sum()), 1)):
            x, high = _MARGIN + b * step + 3.0 + k * wide, _TALL * float(value)
            at = f'x="{x:.1f}" y="{_LOW - high:.1f}" width="{wide:.1f}" height="{high:.1f}"'
            parts.append(f'<rect class="bar{k}" {at}/>')
    parts += [_under(10 * b, _MARGIN + b * step) for b in range(11)]
    return _svg(_WIDTH, _LOW + 50.0, title, parts)


def over_range(figures: Sequence[tuple[str, BoxFigures]], title: str) -> str:
    """Draw the share of returns inside their box against their range, where there are enough."""
    parts = _axes("range [m]", figures)
    shown = [[share for share in one.ranges if share.returns >= _FEWEST_RETURNS] for _, one in figures]
    farthest = max((share.high_m for shares in shown for share in shares), default=10.0)
    for k, shares in enumerate(shown):
        for share in shares:
            x = _MARGIN + (_WIDTH - 2 * _MARGIN) * 0.5 * (share.low_m + share.high_m) / farthest
            y = _LOW - _TALL * share.inside / share.returns
            parts.append(f'<circle class="bar{k}" cx="{x:.1f}" cy="{y:.1f}" r="5"/>')
    parts += [
        _under(metres, _MARGIN + (_WIDTH - 2 * _MARGIN) * metres / farthest)
        for metres in range(0, int(farthest) + 1, 10)
    ]
    return _svg(_WIDTH, _LOW + 50.0, title, parts)


def _axes(below: str, figures: Sequence[tuple[str, BoxFigures]]) -> list[str]:
    """Draw the axes, a grid of per cent, what is below, and which colour is which."""
    parts = []
    for percent in (25, 50, 75, 100):
        y = _LOW - _TALL * percent / 100.0
        parts.append(f'<path class="grid" d="M{_MARGIN:.0f} {y:.0f}H{_WIDTH - _MARGIN:.0f}"/>')
        parts.append(f'<text class="end" x="{_MARGIN - 6:.0f}" y="{y + 5:.0f}">{percent} %</text>')
    parts.append(f'<path class="axis" d="M{_MARGIN:.0f} {_LOW - _TALL:.0f}V{_LOW:.0f}H{_WIDTH - _MARGIN:.0f}"/>')
    parts.append(f'<text class="middle" x="{_WIDTH / 2:.0f}" y="{_LOW + 40:.0f}">{below}</text>')
    for k, (name, _) in enumerate(figures):
        x = _MARGIN + 8.0 + 170.0 * k
        parts.append(f'<circle class="bar{k}" cx="{x:.0f}" cy="44" r="5"/><text x="{x + 11:.0f}" y="49">{name}</text>')
    return parts


def _under(value: int, x: float) -> str:
    return f'<text class="middle" x="{x:.1f}" y="{_LOW + 18:.0f}">{value}</text>'


def write_pictures(
    folder: Path,
    calibrations: Sequence[tuple[str, Calibration]],
    judged: Sequence[tuple[str, BoxFigures]],
) -> None:
    """Write fig-2.svg to fig-6.svg.

    Args:
        folder: created if it does not exist.
        calibrations: three with their titles, for Figs. 2 to 4.
        judged: at most three recordings of moving targets with their names, for Figs. 5 and 6.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for number, (title, calibration) in enumerate(calibrations, start=2):
        (folder / f"fig-{number}.svg").write_text(
            residuals(calibration, f"{title}: AED {calibration.metrics.aed_px:.1f} px"), encoding="utf-8"
        )
    (folder / "fig-5.svg").write_text(over_range(judged, "Acc against range"), encoding="utf-8")
    (folder / "fig-6.svg").write_text(histogram(judged, "Share of frames by their Acc"), encoding="utf-8")
