"""Residual plots: vectors over the image, and lengths against range, azimuth, place and time."""

import numpy as np

from calib_core.arrays import Values
from calib_core.results import Calibration
from cocalib.report.markup import Child, Markup, tag
from cocalib.report.plots import Axes, MarkKind, captioned, drawing, mark, rounded_step, text
from cocalib.report.residual_rows import ResidualRows
from cocalib.report.sections.uncertainty import image_layer
from cocalib.view.wording import plain

_WIDTH = 320.0
_LONGEST_SHARE = 0.12
_MOST_DRAWN = 400
"""More marks than this in one plot are only ink; every k-th is drawn."""


def residuals(calibration: Calibration, rows: ResidualRows, *, of: str, with_image: bool) -> Markup:
    """Return the plots.

    Args:
        calibration: with the camera.
        rows: the residuals.
        of: whose they are, for the heading.
        with_image: whether the page defines a frame.
    """
    heading = tag("h2", f"Residuals {of}")
    if not rows.drawn.any():
        return tag("section", heading, tag("p", "There are no residuals: no pair has a reprojection.", class_="note"))
    size_px = calibration.camera.width_px, calibration.camera.height_px
    centre = (np.array(size_px) - 1) / 2
    from_middle = np.linalg.norm(rows.pixels_px - centre, axis=1)
    every = max(1, int(np.ceil(rows.drawn.sum() / _MOST_DRAWN)))
    notes = ["Length: distance from click to reprojection."]
    if every > 1:
        notes.append(f"One in {every} pairs is drawn.")
    plots: list[Child] = [
        _vectors(calibration, rows, every, with_image=with_image),
        _scatter_plot(rows, rows.ranges_m, every, "Length against range", "range [m]"),
        _scatter_plot(
            rows,
            rows.azimuths_deg,
            every,
            "Length against azimuth",
            "azimuth [deg], left is positive",
            mirrored=True,
        ),
        _scatter_plot(rows, from_middle, every, "Length across the image", "distance from the middle [px]"),
        _scatter_plot(rows, rows.times_s, every, "Length against time", "time since the first pair [s]"),
        _lengths(rows),
    ]
    return tag(
        "section",
        heading,
        tag("p", *legend(), " ".join(notes), class_="note keys"),
        tag("div", *plots, class_="three"),
        id="residuals",
    )


def legend() -> list[Child]:
    """Return what the marks mean."""
    shapes: tuple[tuple[MarkKind, str], ...] = (
        ("used", "agrees"),
        ("disagrees", "disagrees"),
        ("excluded", "left out by the user"),
    )
    return [tag("span", _key(kind), f" {words}") for kind, words in shapes]


def _key(kind: MarkKind) -> Markup:
    return tag(
        "svg",
        mark(kind, 5.0, 5.0),
        viewBox="0 0 10 10",
        class_="key",
        aria_hidden="true",
        xmlns="http://www.w3.org/2000/svg",
    )


def _vectors(calibration: Calibration, rows: ResidualRows, every: int, *, with_image: bool) -> Markup:
    """Return residuals as lines from the click to the reprojection, magnified by a round factor that the heading states."""
    scale = _WIDTH / calibration.camera.width_px
    height = _WIDTH * calibration.camera.height_px / calibration.camera.width_px
    typical = float(np.percentile(rows.lengths_px[rows.drawn], 90.0))
    factor = rounded_step(_LONGEST_SHARE * _WIDTH / max(typical * scale, 1e-6)) / 2 if typical > 0 else 1.0
    factor = min(max(factor, 1.0), 1000.0)
    drawn: list[Child] = []
    for index in np.flatnonzero(rows.drawn)[::every].tolist():
        x, y = ((rows.pixels_px[index] + 0.5) * scale).tolist()
        dx, dy = (rows.residuals_px[index] * scale * factor).tolist()
        drawn += [tag("line", x1=x, y1=y, x2=x + dx, y2=y + dy, class_="vector"), mark(rows.kinds[index], x, y)]
    shown = tag("svg", *drawn, x=0.0, y=0.0, width=_WIDTH, height=height, class_="clip", aria_hidden="true")
    image = drawing(
        f"Residual vectors over the image, drawn {factor:g} times as long.",
        *image_layer(calibration, with_image=with_image),
        shown,
        width=_WIDTH,
        height=height,
    )
    times = "" if factor == 1.0 else f", {factor:g} times long"
    return captioned(f"Click to reprojection{times}", image)


def _scatter_plot(
    rows: ResidualRows, values: Values, every: int, heading: str, label: str, *, mirrored: bool = False
) -> Markup:
    shown = rows.drawn & np.isfinite(values)
    if not shown.any():
        empty = drawing(f"{heading}: nothing to draw.", text(_WIDTH / 2, 88, "nothing to draw", class_="middle"))
        return captioned(heading, empty)
    low, high = float(values[shown].min()), float(values[shown].max())
    room = 0.04 * (high - low) or 1.0
    low, high = low - room, high + room
    axes = Axes(*((high, low) if mirrored else (low, high)), 0.0, 1.05 * max(float(rows.lengths_px[shown].max()), 1e-3))
    marks = [
        mark(rows.kinds[index], axes.x(values[index]), axes.y(rows.lengths_px[index]))
        for index in np.flatnonzero(shown)[::every].tolist()
    ]
    return captioned(heading, drawing(f"{heading}.", axes.drawn(label, "length [px]"), *marks))


def _lengths(rows: ResidualRows) -> Markup:
    """Return how many residuals are how long."""
    lengths = rows.lengths_px[rows.drawn]
    step = rounded_step(max(float(lengths.max()), 1e-3) / 14)
    counts = np.bincount((lengths / step).astype(int))
    axes = Axes(0.0, step * len(counts), 0.0, 1.1 * float(counts.max()))
    bars = [
        tag(
            "rect",
            x=axes.x(step * index) + 0.5,
            y=axes.y(float(count)),
            width=max(axes.width / len(counts) - 1, 0.5),
            height=axes.y(0.0) - axes.y(float(count)),
            class_="bar",
        )
        for index, count in enumerate(counts.tolist())
        if count
    ]
    half, most = np.percentile(lengths, [50.0, 90.0]).tolist()
    largest = plain(float(lengths.max()))
    said = f"Half of {len(lengths)} are at most {plain(half)} px, nine in ten at most {plain(most)} px, the largest {largest} px."
    return captioned(
        "How long they are",
        drawing(f"Histogram of residual lengths. {said}", axes.drawn("length [px]", "pairs"), *bars),
        said,
    )
