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
    ".bar{fill:#0072b2}.bar2{fill:#e69f00}</style>"
)
_WIDTH, _MARGIN = 640.0, 46.0


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
    low, tall, bins = 250.0, 200.0, np.linspace(0.0, 1.0, 11)
    counts = [np.histogram([f.share for f in one.frames if f.returns], bins)[0] for _, one in figures]
    shares = [count / max(int(count.sum()), 1) for count in counts]
    most = max(float(share.max()) for share in shares)
    step = (_WIDTH - 2 * _MARGIN) / 10.0
    wide = (step - 6.0) / len(figures)
    parts = [f'<path class="axis" d="M{_MARGIN} {low - tall}V{low}H{_WIDTH - _MARGIN}"/>']
    for k, ((name, _), share) in enumerate(zip(figures, shares, strict=True)):
        kind = "bar" if k == 0 else "bar2"
        for b, value in enumerate(share):
            tall_px = tall * float(value) / most
            x = _MARGIN + b * step + 3.0 + k * wide
            parts.append(
                f'<rect class="{kind}" x="{x:.1f}" y="{low - tall_px:.1f}" width="{wide:.1f}" height="{tall_px:.1f}"/>'
            )
        parts.append(f'<rect class="{kind}" x="{_MARGIN + 20 + 150 * k:.0f}" y="30" width="12" height="12"/>')
        parts.append(f'<text x="{_MARGIN + 38 + 150 * k:.0f}" y="41">{name}</text>')
    parts += [f'<text x="{_MARGIN + b * step - 8:.0f}" y="{low + 18:.0f}">{10 * b}</text>' for b in range(11)]
    parts.append(f'<text x="{_WIDTH / 2 - 80:.0f}" y="{low + 38:.0f}">returns inside their box [%]</text>')
    parts.append(f'<text x="6" y="{low - tall + 6:.0f}">{100 * most:.0f} %</text>')
    return _svg(_WIDTH, low + 50.0, title, parts)


def over_range(figures: Sequence[tuple[str, BoxFigures]], title: str) -> str:
    """Draw the share of returns inside their box against their range."""
    low, tall = 250.0, 200.0
    farthest = max(share.high_m for _, one in figures for share in one.ranges if share.returns)
    parts = [f'<path class="axis" d="M{_MARGIN} {low - tall}V{low}H{_WIDTH - _MARGIN}"/>']
    for percent in (25, 50, 75, 100):
        y = low - tall * percent / 100.0
        parts.append(
            f'<path class="grid" d="M{_MARGIN} {y:.1f}H{_WIDTH - _MARGIN}"/><text x="8" y="{y + 5:.1f}">{percent} %</text>'
        )
    for k, (name, one) in enumerate(figures):
        kind = "bar" if k == 0 else "bar2"
        for share in one.ranges:
            if share.returns:
                x = _MARGIN + (_WIDTH - 2 * _MARGIN) * 0.5 * (share.low_m + share.high_m) / farthest
                y = low - tall * share.inside / share.returns
                parts.append(f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="5"/>')
        parts.append(f'<circle class="{kind}" cx="{_MARGIN + 26 + 150 * k:.0f}" cy="36" r="5"/>')
        parts.append(f'<text x="{_MARGIN + 38 + 150 * k:.0f}" y="41">{name}</text>')
    for metres in range(0, int(farthest) + 1, 10):
        x = _MARGIN + (_WIDTH - 2 * _MARGIN) * metres / farthest
        parts.append(f'<text x="{x - 6:.1f}" y="{low + 18:.0f}">{metres}</text>')
    parts.append(f'<text x="{_WIDTH / 2 - 30:.0f}" y="{low + 38:.0f}">range [m]</text>')
    return _svg(_WIDTH, low + 50.0, title, parts)


def write_pictures(
    folder: Path,
    calibrations: Sequence[tuple[str, Calibration]],
    people: BoxFigures,
    cars: BoxFigures,
) -> None:
    """Write fig-2.svg to fig-6.svg.

    Args:
        folder: created if it does not exist.
        calibrations: three with their titles, for Figs. 2 to 4.
        people: for Figs. 5 and 6.
        cars: likewise.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for number, (title, calibration) in enumerate(calibrations, start=2):
        (folder / f"fig-{number}.svg").write_text(residuals(calibration, title), encoding="utf-8")
    both = [("people", people), ("cars", cars)]
    (folder / "fig-5.svg").write_text(over_range(both, "Acc against range"), encoding="utf-8")
    (folder / "fig-6.svg").write_text(histogram(both, "Acc of each frame"), encoding="utf-8")
