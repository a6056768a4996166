"""The report on a lens, from the figures to be judged to everything that was measured."""

import math

import numpy as np

from calib_core.camera import Camera
from calib_core.interchange.own.lens_documents import ImageSource
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.coverage import Coverage
from calib_core.intrinsics.image_maps import MODEL_ERRORS_UNSEEN, projection_uncertainty, residual_field
from calib_core.intrinsics.split_difference import split_difference
from calib_core.measurements import Unsolvable
from calib_core.words.intrinsics import halves_text, residuals_text
from calib_core.words.warnings import warning_remark
from cocalib.intrinsics.field_of_view import field_of_view_text
from cocalib.report.markup import Child, Markup, html_file, scrolled, tag
from cocalib.report.plots import Axes, captioned, drawing, mark, text
from cocalib.view.wording import plain, sentence, with_sigma

_MOST_ROWS = 400
_WIDTH = 320.0
_LONGEST = 22.0


def lens_report_html(lens: CalibratedLens, source: ImageSource, coverage: Coverage, *, searched: int) -> str:
    """Return the report as HTML that is well-formed XML, too; the same lens gives the same bytes.

    Args:
        lens: with its views.
        source: of the images.
        coverage: of the used views.
        searched: how many images were looked at.
    """
    body = tag(
        "body",
        tag(
            "header",
            tag("h1", "Camera lens report"),
            tag("p", tag("b", source.name), f", {lens.board.text}, {1e3 * lens.board.square_m:g} mm"),
        ),
        tag(
            "main",
            _answer(lens, searched),
            _warning_list(lens),
            _uncertainty_over_the_image(lens),
            _residuals_over_the_image(lens),
            _coverage_of_views(lens, coverage),
            _view_table(lens),
            _left_out_table(lens),
        ),
        tag("footer", _foot()),
    )
    return html_file(f"Camera lens report: {source.name}", body)


def _answer(lens: CalibratedLens, searched: int) -> Markup:
    camera = lens.camera
    said = (
        f"{camera.model}, {camera.width_px} x {camera.height_px} px, field of view {field_of_view_text(camera)}. "
        f"RMS {lens.rms_px:.3f} px in {len(lens.views)} used views, {lens.held_out_rms_px:.3f} px in views left out in turn; "
        f"{searched} images searched, {len(lens.left_out)} left out."
    )
    return tag(
        "section",
        tag("h2", "The lens"),
        tag("p", said),
        tag("div", _parameter_table(lens), _model_table(lens), class_="two"),
        id="lens",
    )


def _foot() -> str:
    return (
        "Pixel (0, 0) is the center of the top-left pixel. Sigma is one standard deviation. Held out: with the lens calibrated "
        "without that view. The same images give the same file, byte for byte."
    )


def _warning_list(lens: CalibratedLens) -> Markup:
    """Return the warnings with what to do."""
    items = [
        tag("li", tag("code", warning.code), " ", sentence(str(said.message)), " ", tag("b", sentence(str(said.hint))))
        for warning, said in zip(lens.warnings, map(warning_remark, lens.warnings), strict=True)
    ]
    body = tag("ul", *items, class_="cautions") if items else tag("p", "No warnings.", class_="note")
    return tag("section", tag("h2", "Warnings"), body, id="cautions")


def _parameter_table(lens: CalibratedLens) -> Markup:
    """Return the parameters with their standard deviations."""
    camera = lens.camera
    known = camera.covariance
    rows = [
        _row(
            name.removesuffix("_px") + (" [px]" if name.endswith("_px") else ""),
            plain(value, 6) if known is None else with_sigma(value, known.sigma(name)),
        )
        for name, value in zip(camera.parameter_names, camera.parameters.tolist(), strict=True)
    ]
    return tag("div", tag("h3", f"Parameters ({camera.model})"), _table("Parameters", ("", "value ± sigma"), rows))


def _model_table(lens: CalibratedLens) -> Markup:
    """Return the models that were tried."""
    rows = [
        _row(
            trial.model,
            _pixels(trial.rms_px),
            _pixels(trial.held_out_rms_px),
            trial.fault or f"{trial.worse_by:.4f} ± {trial.standard_error:.4f}",
        )
        for trial in lens.trials
    ]
    heads = ("model", "RMS [px]", "leave-one-out [px]", "worse by [px²]")
    return tag(
        "div", tag("h3", "Models"), _table("Models", heads, rows), tag("p", sentence(lens.choice), class_="note")
    )


def _view_table(lens: CalibratedLens) -> Markup:
    """Return every used view with its errors."""
    rows = [
        _row(
            view.corners.name,
            f"{int(view.used.sum())} of {len(view.used)}",
            _pixels(view.rms_px),
            _pixels(view.held_out_rms_px),
            _pixels(view.corners.blur_px),
        )
        for view in lens.views[:_MOST_ROWS]
    ]
    heads = ("view", "corners used", "RMS [px]", "leave-one-out [px]", "blur [px]")
    return tag("section", tag("h2", "Every view"), _table("Views", heads, rows), id="every-view")


def _left_out_table(lens: CalibratedLens) -> Markup:
    """Return the images that were not used, with the reasons."""
    rows = [tag("li", tag("b", one.name), f": {one.reason}") for one in lens.left_out[:_MOST_ROWS]]
    if len(lens.left_out) > _MOST_ROWS:
        rows.append(tag("li", f"{len(lens.left_out) - _MOST_ROWS} more."))
    body = tag("ul", *rows) if rows else tag("p", "None: every image with a board was used.", class_="note")
    return tag("section", tag("h2", "Left out"), body, id="left-out")


def _row(head: str, *cells: str) -> Markup:
    return tag("tr", tag("th", head, scope="row"), *(tag("td", cell) for cell in cells))


def _table(name: str, heads: tuple[str, ...], rows: list[Markup]) -> Markup:
    titles: list[Child] = [tag("th", head, scope="col") for head in heads]
    return scrolled(name, tag("thead", tag("tr", *titles)), tag("tbody", *rows), class_="figures")


def _pixels(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else "–"


def _residuals_over_the_image(lens: CalibratedLens) -> Markup:
    """Return the mean residuals as arrows over the image."""
    found, camera = residual_field(lens), lens.camera
    means = found.means_px.reshape(-1, 2)
    x_px, y_px = (axis.ravel() for axis in np.meshgrid(found.x_px, found.y_px))
    there = np.isfinite(means).all(axis=1)
    longest = float(np.hypot(*means[there].T).max()) if there.any() else 0.0
    gain = _LONGEST / max(longest, 1e-9)
    shapes: list[Child] = [_image_frame(camera)]
    scale = _WIDTH / camera.width_px
    for x, y, (du, dv) in zip(x_px[there], y_px[there], means[there].tolist(), strict=True):
        at_u, at_v = (x + 0.5) * scale, (y + 0.5) * scale
        shapes.append(tag("line", x1=at_u, y1=at_v, x2=at_u + gain * du, y2=at_v + gain * dv, class_="vector"))
        shapes.append(tag("circle", cx=at_u, cy=at_v, r=1.6, class_="used"))
    said = (
        f"Mean residual of each part of the image; the longest line is {plain(longest, 2)} px. {residuals_text(found)}"
    )
    drawn = captioned("Mean residuals", _image_map(said, camera, *shapes), said)
    return tag("section", tag("h2", "Residuals"), drawn, id="residuals")


def _uncertainty_over_the_image(lens: CalibratedLens) -> Markup:
    """Return how far the projection of far points is known, and two halves of the views calibrated separately."""
    grid = projection_uncertainty(lens, columns=16, rows=10)
    sigmas = grid.sigma_px
    finite = sigmas[np.isfinite(sigmas)]
    span = f"{plain(float(finite.min()), 2)} to {plain(float(finite.max()), 2)} px" if len(finite) else "not known"
    said = f"Standard deviation of a far point's pixel: {span}; the darker, the less is known. {MODEL_ERRORS_UNSEEN}"
    drawn = _image_map(said, lens.camera, *_cells(sigmas, lens.camera), _image_frame(lens.camera))
    shown: list[Child] = [captioned("Projection uncertainty", drawn, said)]
    halves = split_difference(lens)
    if isinstance(halves, Unsolvable):
        shown.append(tag("p", f"Not cross-checked: {halves_text(halves)}", class_="note"))
    else:
        cells = _cells(halves.apart_px, lens.camera)
        drawn = _image_map(halves_text(halves), lens.camera, *cells, _image_frame(lens.camera))
        words = f"Distance between the projections of both lenses. {halves_text(halves)}"
        shown.append(captioned("Halves calibrated separately", drawn, words))
    return tag("section", tag("h2", "How well the lens is known"), tag("div", *shown, class_="two"), id="uncertainty")


def covered(lens: CalibratedLens, coverage: Coverage) -> Markup:
    """Return how many corners lie in each part of the image."""
    camera = lens.camera
    rows, columns = coverage.counts.shape
    most = max(int(coverage.counts.max()), 1)
    height = _height(camera)
    shapes: list[Child] = [_image_frame(camera)]
    for row in range(rows):
        for column in range(columns):
            count = int(coverage.counts[row, column])
            left, top = _WIDTH * column / columns, height * row / rows
            shade = _share_text(0.75 * (count / most) ** 0.5)
            shapes.append(_cell(left, top, _WIDTH / columns, height / rows, shade))
            shapes.append(
                text(left + _WIDTH / columns / 2, top + height / rows / 2 + 3, str(count), class_="middle label")
            )
    said = f"Corners in each part of the image; {100.0 * coverage.share:.0f} % of it is covered."
    return captioned("In the image", _image_map(said, camera, *shapes), said)


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


def _image_frame(camera: Camera) -> Markup:
    return tag("rect", x=0.0, y=0.0, width=_WIDTH, height=_height(camera), class_="frame")


def _height(camera: Camera) -> float:
    return _WIDTH * camera.height_px / camera.width_px


def _image_map(alternative: str, camera: Camera, *shapes: Child) -> Markup:
    return drawing(alternative, *shapes, width=_WIDTH, height=_height(camera))


def _coverage_of_views(lens: CalibratedLens, coverage: Coverage) -> Markup:
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
