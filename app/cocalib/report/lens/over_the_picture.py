"""What varies over the picture: residuals, how far the projection is known, and where corners were found."""

import numpy as np

from calib_core.camera import Camera
from calib_core.intrinsics import (
    MODEL_ERRORS_UNSEEN,
    CalibratedLens,
    ResidualField,
    projection_uncertainty,
    residual_field,
    split_difference,
)
from calib_core.intrinsics.coverage import Coverage
from calib_core.measurements import Unsolvable
from cocalib.report.markup import Child, Markup, tag
from cocalib.report.plots import Axes, captioned, drawing, text
from cocalib.view.wording import plain

_WIDTH = 320.0
_MOST_POINTS = 1500
_LONGEST = 22.0


def residuals_over_the_picture(lens: CalibratedLens) -> Markup:
    """Return the mean residuals as arrows over the picture, and all residuals as a scatter."""
    found = residual_field(lens)
    return tag(
        "section",
        tag("h2", "Residuals"),
        tag("div", _arrows(found, lens.camera), _scatter(found), class_="two"),
        id="residuals",
    )


def _arrows(found: ResidualField, camera: Camera) -> Markup:
    means = found.means_px.reshape(-1, 2)
    x_px, y_px = (axis.ravel() for axis in np.meshgrid(found.x_px, found.y_px))
    there = np.isfinite(means).all(axis=1)
    longest = float(np.hypot(*means[there].T).max()) if there.any() else 0.0
    gain = _LONGEST / max(longest, 1e-9)
    shapes: list[Child] = [_picture_frame(camera)]
    for x, y, (du, dv) in zip(x_px[there], y_px[there], means[there].tolist(), strict=True):
        at_u, at_v = _places(camera, x, y)
        shapes.append(tag("line", x1=at_u, y1=at_v, x2=at_u + gain * du, y2=at_v + gain * dv, class_="vector"))
        shapes.append(tag("circle", cx=at_u, cy=at_v, r=1.6, class_="used"))
    said = f"Mean residual of each part of the picture; the longest line is {plain(longest, 2)} px. {found.sentence}"
    return captioned("Mean residuals", _over_picture(said, camera, *shapes), said)


def _scatter(found: ResidualField) -> Markup:
    residuals = found.residuals_px
    reach = max(float(np.abs(residuals).max()), 1e-3)
    axes = Axes(-reach, reach, -reach, reach, left=90.0, top=8.0, width=138.0, height=138.0)
    step = -(-len(residuals) // _MOST_POINTS)
    points = [tag("circle", cx=axes.x(u), cy=axes.y(-v), r=0.9, class_="radar") for u, v in residuals[::step].tolist()]
    rms = float(np.sqrt(np.square(residuals).sum(axis=1).mean()))
    said = f"{len(residuals)} corners, projected minus found; root mean square distance {rms:.3f} px."
    return captioned("All residuals", drawing(said, axes.drawn("right [px]", "down, negative [px]"), *points), said)


def uncertainty_over_the_picture(lens: CalibratedLens) -> Markup:
    """Return how far the projection of far points is known, and two halves of the views calibrated separately."""
    grid = projection_uncertainty(lens, columns=16, rows=10)
    sigmas = grid.sigma_px
    finite = sigmas[np.isfinite(sigmas)]
    span = f"{plain(float(finite.min()), 2)} to {plain(float(finite.max()), 2)} px" if len(finite) else "not known"
    said = f"Standard deviation of a far point's pixel: {span}; the darker, the less is known. {MODEL_ERRORS_UNSEEN}"
    drawn = _over_picture(said, lens.camera, *_cells(sigmas, lens.camera), _picture_frame(lens.camera))
    shown: list[Child] = [captioned("Projection uncertainty", drawn, said)]
    halves = split_difference(lens)
    if isinstance(halves, Unsolvable):
        shown.append(tag("p", f"Not cross-checked: {halves.reason}.", class_="note"))
    else:
        cells = _cells(halves.apart_px, lens.camera)
        drawn = _over_picture(halves.sentence, lens.camera, *cells, _picture_frame(lens.camera))
        words = f"Distance between the projections of both lenses. {halves.sentence}"
        shown.append(captioned("Halves calibrated separately", drawn, words))
    return tag("section", tag("h2", "How well the lens is known"), tag("div", *shown, class_="two"), id="uncertainty")


def covered(lens: CalibratedLens, coverage: Coverage) -> Markup:
    """Return how many corners lie in each part of the picture."""
    camera = lens.camera
    rows, columns = coverage.counts.shape
    most = max(int(coverage.counts.max()), 1)
    height = _height(camera)
    shapes: list[Child] = [_picture_frame(camera)]
    for row in range(rows):
        for column in range(columns):
            count = int(coverage.counts[row, column])
            left, top = _WIDTH * column / columns, height * row / rows
            shade = _share_text(0.75 * (count / most) ** 0.5)
            shapes.append(_cell(left, top, _WIDTH / columns, height / rows, shade))
            shapes.append(
                text(left + _WIDTH / columns / 2, top + height / rows / 2 + 3, str(count), class_="middle label")
            )
    said = f"Corners in each part of the picture; {100.0 * coverage.share:.0f} % of it is covered."
    return captioned("In the picture", _over_picture(said, camera, *shapes), said)


def _share_text(value: float) -> str:
    """Write a share with three decimals."""
    return f"{value:.3f}"


def _cells(values: np.ndarray, camera: Camera) -> list[Child]:
    """Return a shaded cell for each value, on a logarithmic scale, with the value in some of them."""
    rows, columns = values.shape
    width, height = _WIDTH / columns, _height(camera) / rows
    finite = values[np.isfinite(values) & (values > 0)]
    low, high = (float(np.log(finite.min())), float(np.log(finite.max()))) if len(finite) else (0.0, 1.0)
    shapes: list[Child] = []
    labels: list[Child] = []
    for row, column in np.ndindex(rows, columns):
        value = float(values[row, column])
        if not np.isfinite(value) or value <= 0:
            continue
        share = (np.log(value) - low) / max(high - low, 1e-9)
        shapes.append(_cell(column * width, row * height, width, height, _share_text(0.05 + 0.7 * share)))
        if row % 3 == 0 and column % 5 == 0:
            at = (column + 0.5) * width, (row + 0.5) * height + 3
            labels.append(text(*at, plain(value, 2), class_="middle label"))
    return [*shapes, *labels]


def _cell(left: float, top: float, width: float, height: float, shade: str) -> Markup:
    return tag("rect", x=left, y=top, width=width, height=height, class_="shaded", fill_opacity=shade)


def _picture_frame(camera: Camera) -> Markup:
    return tag("rect", x=0.0, y=0.0, width=_WIDTH, height=_height(camera), class_="frame")


def _height(camera: Camera) -> float:
    return _WIDTH * camera.height_px / camera.width_px


def _places(camera: Camera, u_px: float, v_px: float) -> tuple[float, float]:
    scale = _WIDTH / camera.width_px
    return (u_px + 0.5) * scale, (v_px + 0.5) * scale


def _over_picture(alternative: str, camera: Camera, *shapes: Child) -> Markup:
    return drawing(alternative, *shapes, width=_WIDTH, height=_height(camera))
