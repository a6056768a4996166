"""Where the pairs are: in the image, and seen from above by range and azimuth."""

import numpy as np

from calib_core.results import Calibration
from cocalib.report.markup import Child, Markup, tag
from cocalib.report.plots import captioned, drawing, mark, polyline, rounded_step, text
from cocalib.report.residual_rows import ResidualRows
from cocalib.report.sections.uncertainty import image_layer
from cocalib.view.wording import plain

_WIDTH = 320.0
_ROWS, _COLUMNS = ("upper", "middle", "lower"), ("left", "centre", "right")


def coverage(calibration: Calibration, rows: ResidualRows, *, with_image: bool) -> Markup | None:
    """Return both drawings, each with its sentence; None without pairs."""
    if not len(rows):
        return None
    return tag(
        "section",
        tag("h2", "Coverage"),
        tag("div", _in_image(calibration, rows, with_image=with_image), _from_above(rows), class_="two"),
        id="coverage",
    )


def _in_image(calibration: Calibration, rows: ResidualRows, *, with_image: bool) -> Markup:
    camera = calibration.camera
    scale, height = _WIDTH / camera.width_px, _WIDTH * camera.height_px / camera.width_px
    counts = _counts(rows.pixels_px[rows.judged], (camera.width_px, camera.height_px))
    lines: list[Child] = [
        *(tag("line", x1=_WIDTH * k / 3, x2=_WIDTH * k / 3, y1=0.0, y2=height, class_="grid") for k in (1, 2)),
        *(tag("line", x1=0.0, x2=_WIDTH, y1=height * k / 3, y2=height * k / 3, class_="grid") for k in (1, 2)),
    ]
    labels = [
        text(_WIDTH * (column + 1) / 3 - 5, height * (row + 1) / 3 - 5, str(counts[row, column]), class_="end label")
        for row in range(3)
        for column in range(3)
    ]
    marks = [
        mark(kind, (u + 0.5) * scale, (v + 0.5) * scale)
        for kind, (u, v) in zip(rows.kinds, rows.pixels_px.tolist(), strict=True)
    ]
    said = _image_words(counts)
    layer = image_layer(calibration, with_image=with_image)
    drawn = drawing(f"Clicks in the image. {said}", *layer, *lines, *marks, *labels, width=_WIDTH, height=height)
    return captioned("In the image", drawn, said)


def _counts(pixels_px: np.ndarray, size_px: tuple[int, int]) -> np.ndarray:
    """Count clicks in each ninth of the image: (3, 3), rows first."""
    cells = np.clip(((pixels_px + 0.5) * 3 / np.array(size_px)).astype(int), 0, 2)
    counts = np.zeros((3, 3), dtype=int)
    np.add.at(counts, (cells[:, 1], cells[:, 0]), 1)
    return counts


def _image_words(counts: np.ndarray) -> str:
    empty = [f"{_ROWS[row]} {_COLUMNS[column]}" for row, column in zip(*np.nonzero(counts == 0), strict=True)]
    total = int(counts.sum())
    clicks = f"{total} {'click' if total == 1 else 'clicks'}"
    if not empty:
        return f"The {clicks} reach all nine parts of the image."
    return f"The {clicks} reach {9 - len(empty)} of nine parts of the image; none is in: {', '.join(empty)}."


def _from_above(rows: ResidualRows) -> Markup:
    """Return the radar's field seen from above, with arcs at round ranges."""
    used = rows.judged
    farthest_m = max(float(rows.ranges_m.max()), 1.0)
    step_m = rounded_step(farthest_m / 4)
    rings = int(np.ceil(farthest_m / step_m - 1e-9))
    reach, origin_y = step_m * rings, 168.0
    scale = 150.0 / reach
    angles = np.deg2rad(np.linspace(-75.0, 75.0, 31))
    shapes: list[Child] = [
        polyline(
            [
                (160.0 - scale * step_m * ring * np.sin(angle), origin_y - scale * step_m * ring * np.cos(angle))
                for angle in angles
            ],
            class_="grid",
        )
        for ring in range(1, rings + 1)
    ]
    labels = [
        text(162.0, origin_y - scale * step_m * ring - 2, f"{step_m * ring:g} m", class_="label")
        for ring in range(1, rings + 1)
    ]
    marks = [
        mark(kind, 160.0 - scale * y, origin_y - scale * x)
        for kind, (x, y, _) in zip(rows.kinds, rows.points_radar_m.tolist(), strict=True)
    ]
    radar = tag("path", d=f"M154 {origin_y:g}L166 {origin_y:g}L160 {origin_y - 8:g}Z", class_="radar")
    said = _range_words(rows.ranges_m[used], rows.azimuths_deg[used], rows.elevations_deg[used])
    return captioned("From above", drawing(f"Pairs seen from above. {said}", *shapes, radar, *labels, *marks), said)


def _range_words(ranges_m: np.ndarray, azimuths_deg: np.ndarray, elevations_deg: np.ndarray) -> str:
    if not len(ranges_m):
        return "No pair agrees."
    near, far = plain(float(ranges_m.min())), plain(float(ranges_m.max()))
    right, left, low, high = (
        plain(float(one), 2)
        for one in (azimuths_deg.min(), azimuths_deg.max(), elevations_deg.min(), elevations_deg.max())
    )
    return (
        f"Ranges {near} to {far} m, azimuths {right} to {left} deg, elevations {low} to {high} deg; "
        "what lies beyond is extrapolated."
    )
