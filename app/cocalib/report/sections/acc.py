"""Acc: returns in boxes, per frame, against range and per class, and how little it feels a wrong rotation."""

from collections.abc import Sequence

import numpy as np

from calib_core.evaluation.figures import BoxFigures, Sensitivity, Share
from cocalib.report.markup import Child, Markup, tag
from cocalib.report.plots import Axes, captioned, drawing, polyline, text
from cocalib.view.wording import plain, sentence

_BINS = 10
_LINES = ("contour a", "contour b", "contour c")
_DASHES = ("solid", "dashed", "dotted")
_MOST_CLASSES = 8
_FULL = 20
"""With fewer returns a bin of range says nothing."""


def acc(figures: BoxFigures) -> Markup:
    """Return the section."""
    shown = [_histogram(figures), _by_range(figures), _sensitivity(figures)]
    return tag(
        "section",
        tag("h2", "Returns in boxes (Acc)"),
        tag("p", tag("strong", _summary(figures))),
        tag("p", _WARNING, class_="note"),
        tag("div", *shown, class_="three") if figures.frames else None,
        _classes(figures) if figures.classes else None,
        tag("p", f"{sentence(figures.rule)} Boxes: {figures.source}.", class_="note"),
        id="acc",
    )


_WARNING = (
    "Acc is not accuracy: it only says that returns fall into boxes, which are wide. The curves show how far the calibration can "
    "be turned before Acc notices; no Acc, however high, replaces the uncertainty above."
)


def _summary(figures: BoxFigures) -> str:
    if figures.acc is None:
        return "Acc is unknown: no frame has returns of targets."
    error = figures.acc_standard_error
    spread = f" ± {_percent(error)}" if np.isfinite(error) else ""
    counted = sum(frame.returns > 0 for frame in figures.frames)
    others = []
    if figures.acc_without_zero_frames is not None:
        others.append(f"without the frames of 0 %: {_percent(figures.acc_without_zero_frames)} %")
    if figures.chance is not None:
        others.append(f"turned by 10 deg, which is about chance: {_percent(figures.chance)} %")
    return f"Acc {_percent(figures.acc)}{spread} % over {counted} frames" + (
        f" ({'; '.join(others)})." if others else "."
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f}" if np.isfinite(share) else "–"


def _histogram(figures: BoxFigures) -> Markup:
    shares = np.array([frame.share for frame in figures.frames if frame.returns])
    counts = (
        np.bincount(np.minimum((shares * _BINS).astype(int), _BINS - 1), minlength=_BINS)
        if len(shares)
        else np.zeros(_BINS, dtype=int)
    )
    axes = Axes(0.0, 1.0, 0.0, 1.1 * max(float(counts.max()), 1.0))
    bars = [
        _bar(axes, index / _BINS, (index + 1) / _BINS, float(count))
        for index, count in enumerate(counts.tolist())
        if count
    ]
    none, whole = int((shares == 0).sum()), int((shares == 1).sum())
    said = f"Of {len(shares)} frames {whole} have all returns inside and {none} have none; frames of 0 % are kept."
    drawn = drawing(
        f"Histogram of Acc per frame. {said}", axes.drawn("returns inside [%]", "frames", x_percent=True), *bars
    )
    return captioned("Acc per frame", drawn, said)


def _by_range(figures: BoxFigures) -> Markup:
    bins = [one for one in figures.ranges if one.returns]
    if not bins:
        return captioned(
            "Acc against range", drawing("No returns", text(160, 88, "no returns", class_="middle")), "No returns."
        )
    axes = Axes(min(one.low_m for one in bins), max(one.high_m for one in bins), 0.0, 1.05)
    bars = [_bar(axes, one.low_m, one.high_m, one.inside / one.returns) for one in bins]
    full = [one for one in bins if one.returns >= _FULL] or bins
    best, worst = (choose(full, key=lambda one: one.inside / one.returns) for choose in (max, min))
    said = (
        f"Best at {_bin_words(best)}, worst at {_bin_words(worst)}."
        if len(full) > 1
        else f"Nearly all returns are at {_bin_words(best)}."
    )
    drawn = drawing(f"Acc against range. {said}", axes.drawn("range [m]", "returns inside [%]", y_percent=True), *bars)
    return captioned("Acc against range", drawn, said)


def _bin_words(one: Share) -> str:
    share = _percent(one.inside / one.returns)
    return f"{plain(one.low_m)} to {plain(one.high_m)} m ({share} % of {one.returns} returns inside)"


def _bar(axes: Axes, low: float, high: float, value: float) -> Markup:
    left, right = axes.x(low), axes.x(high)
    top = axes.y(value)
    return tag("rect", x=left + 0.5, y=top, width=max(right - left - 1, 0.5), height=axes.y(0.0) - top, class_="bar")


def _sensitivity(figures: BoxFigures) -> Markup:
    curves = [one for one in figures.sensitivity if one.angles_deg]
    if not curves:
        return captioned(
            "Acc of a turned calibration",
            drawing("Not computed", text(160, 88, "not computed", class_="middle")),
            "Not computed.",
        )
    least, most = min(curve.angles_deg[0] for curve in curves), max(curve.angles_deg[-1] for curve in curves)
    values = [value for curve in curves for value in curve.acc if np.isfinite(value)]
    high = min(1.05, 1.1 * max(values, default=1.0) + 0.01)
    axes = Axes(least, most, 0.0, high)
    lines: list[Child] = []
    for index, one in enumerate(curves):
        points = [(axes.x(a), axes.y(v)) for a, v in zip(one.angles_deg, one.acc, strict=True) if np.isfinite(v)]
        lines.append(polyline(points, class_=_LINES[index % 3]))
        lines.append(
            text(
                axes.left + 6,
                axes.top + axes.height - 6 - 12 * (len(curves) - 1 - index),
                f"{one.axis}: {_DASHES[index % 3]}",
            )
        )
    said = _sensitivity_words(curves)
    drawn = drawing(f"Acc under rotations. {said}", axes.drawn("turned by [deg]", "Acc [%]", y_percent=True), *lines)
    return captioned("Acc of a turned calibration", drawn, said)


def _sensitivity_words(curves: Sequence[Sensitivity]) -> str:
    """Say for each axis how much Acc changes within one degree, and where it is highest if that is not at 0."""
    parts = []
    for curve in curves:
        angles, values = np.array(curve.angles_deg), np.array(curve.acc)
        near = values[np.abs(angles) <= 1.0 + 1e-9]
        best = float(angles[int(np.nanargmax(values))]) if np.isfinite(values).any() else 0.0
        off = f", highest at {best:+.2g} deg" if best != 0 and values.max() > values[np.argmin(np.abs(angles))] else ""
        change = f"{100.0 * float(np.ptp(near)):.1f} points" if len(near) and np.isfinite(near).all() else "unknown"
        parts.append(f"{curve.axis} {change}{off}")
    return f"Change of Acc within ±1 deg: {'; '.join(parts)}."


def _classes(figures: BoxFigures) -> Markup:
    heads = ("class", "Acc %", "frames", "returns", "inside")
    rows = (
        tag(
            "tr",
            tag("th", one.label or "no box found", scope="row"),
            tag("td", "–" if one.acc is None else _percent(one.acc)),
            *(tag("td", str(count)) for count in (one.frames, one.returns, one.inside)),
        )
        for one in figures.classes[:_MOST_CLASSES]
    )
    head = tag("thead", tag("tr", *(tag("th", head, scope="col") for head in heads)))
    return tag("table", head, tag("tbody", *rows), class_="figures")
