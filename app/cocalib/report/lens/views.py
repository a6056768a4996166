"""The views: how the board was held, and how well each is explained."""

import numpy as np

from calib_core.intrinsics import CalibratedLens
from calib_core.intrinsics.coverage import Coverage
from cocalib.report.lens.over_the_picture import covered
from cocalib.report.markup import Child, Markup, tag
from cocalib.report.plots import Axes, captioned, drawing, mark
from cocalib.view.wording import plain, sentence


def coverage_of_views(lens: CalibratedLens, coverage: Coverage) -> Markup:
    """Return where the corners are, how the board was turned and how far it was, and what to film next."""
    missing: list[Child] = [tag("li", sentence(one)) for one in coverage.missing]
    return tag(
        "section",
        tag("h2", "Coverage"),
        tag("div", covered(lens, coverage), _tilts(lens), _distances(lens), class_="three"),
        tag("ul", *missing) if missing else None,
        id="coverage",
    )


def _tilts(lens: CalibratedLens) -> Markup:
    normals = np.array([view.camera_from_board.rotation[:, 2] for view in lens.views])
    normals = normals * np.where(normals[:, 2:] < 0, -1.0, 1.0)
    sideways = np.degrees(np.arctan2(normals[:, 0], normals[:, 2]))
    upwards = np.degrees(np.arctan2(-normals[:, 1], normals[:, 2]))
    axes = Axes(-70.0, 70.0, -70.0, 70.0, left=90.0, width=138.0)
    inside = np.clip(np.stack([sideways, upwards], axis=1), -70.0, 70.0)
    marks = [mark("used", axes.x(x), axes.y(y)) for x, y in inside.tolist()]
    said = (
        f"Tilt of the board, one mark a view: {plain(float(sideways.min()), 2)} to {plain(float(sideways.max()), 2)} deg "
        f"sideways, {plain(float(upwards.min()), 2)} to {plain(float(upwards.max()), 2)} deg up or down."
    )
    return captioned("Tilts", drawing(said, axes.drawn("sideways [deg]", "up [deg]"), *marks), said)


def _distances(lens: CalibratedLens) -> Markup:
    middle = lens.board_shape_m.mean(axis=0)
    poses = [view.camera_from_board for view in lens.views]
    distances = np.array([np.linalg.norm(pose.rotation @ middle + pose.translation_m) for pose in poses])
    rms = np.array([view.rms_px for view in lens.views])
    axes = Axes(0.0, 1.1 * float(distances.max()), 0.0, 1.15 * max(float(rms.max()), 1e-3))
    marks = [mark("used", axes.x(x), axes.y(y)) for x, y in zip(distances.tolist(), rms.tolist(), strict=True)]
    said = (
        f"Distances of the board from {plain(float(distances.min()), 2)} to {plain(float(distances.max()), 2)} m, "
        "by the stated size of its squares."
    )
    return captioned("Distances", drawing(said, axes.drawn("distance [m]", "RMS [px]"), *marks), said)


def errors_of_views(lens: CalibratedLens) -> Markup:
    """Return the root mean square error of each view: bars where it was used, circles where it was left out."""
    used = np.array([view.rms_px for view in lens.views])
    held_out = np.array([view.held_out_rms_px for view in lens.views])
    highest = max(float(np.nanmax(np.concatenate([used, held_out]))), 1e-3)
    axes = Axes(0.0, float(len(used)), 0.0, 1.1 * highest, width=600.0)
    step = axes.width / len(used)
    floor = axes.y(0.0)
    shapes: list[Child] = []
    for place, (value, other) in enumerate(zip(used.tolist(), held_out.tolist(), strict=True)):
        left, top = axes.left + step * (place + 0.15), axes.y(value)
        shapes.append(tag("rect", x=left, y=top, width=0.7 * step, height=floor - top, class_="bar"))
        if np.isfinite(other):
            shapes.append(mark("used", left + 0.35 * step, axes.y(other)))
    said = "Bars: RMS of the used views; dots: RMS with the lens calibrated without that view."
    drawn = drawing(said, axes.drawn("view", "RMS [px]"), *shapes, width=644.0)
    return tag("section", tag("h2", "Views"), captioned("Errors of the views", drawn, said), id="views")
