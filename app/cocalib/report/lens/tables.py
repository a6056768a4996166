"""Figures of a lens: parameters, the models that were tried, views, pictures left out, warnings."""

import math

from calib_core.intrinsics import CalibratedLens
from cocalib.report.markup import Child, Markup, scrolled, tag
from cocalib.view.wording import plain, sentence, with_sigma

_MOST_ROWS = 400


def warning_list(lens: CalibratedLens) -> Markup:
    """Return the warnings with what to do."""
    items = [
        tag("li", tag("code", one.code), " ", sentence(one.message), " ", tag("b", sentence(one.hint)))
        for one in lens.warnings
    ]
    body = tag("ul", *items, class_="cautions") if items else tag("p", "No warnings.", class_="note")
    return tag("section", tag("h2", "Cautions"), body, id="cautions")


def parameter_table(lens: CalibratedLens) -> Markup:
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


def model_table(lens: CalibratedLens) -> Markup:
    """Return the models that were tried."""
    rows = [
        _row(
            one.model,
            _pixels(one.rms_px),
            _pixels(one.held_out_rms_px),
            one.fault or f"{one.worse_by:.4f} ± {one.standard_error:.4f}",
        )
        for one in lens.trials
    ]
    heads = ("model", "RMS [px]", "held out [px]", "worse by [px²]")
    return tag(
        "div", tag("h3", "Models"), _table("Models", heads, rows), tag("p", sentence(lens.choice), class_="note")
    )


def view_table(lens: CalibratedLens) -> Markup:
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
    heads = ("view", "corners used", "RMS [px]", "held out [px]", "blur [px]")
    return tag("section", tag("h2", "Every view"), _table("Views", heads, rows), id="every-view")


def left_out_table(lens: CalibratedLens) -> Markup:
    """Return the pictures that were not used, with the reasons."""
    rows = [tag("li", tag("b", one.name), f": {one.reason}") for one in lens.left_out[:_MOST_ROWS]]
    if len(lens.left_out) > _MOST_ROWS:
        rows.append(tag("li", f"{len(lens.left_out) - _MOST_ROWS} more."))
    body = tag("ul", *rows) if rows else tag("p", "None: every picture with a board was used.", class_="note")
    return tag("section", tag("h2", "Left out"), body, id="left-out")


def _row(head: str, *cells: str) -> Markup:
    return tag("tr", tag("th", head, scope="row"), *(tag("td", cell) for cell in cells))


def _table(name: str, heads: tuple[str, ...], rows: list[Markup]) -> Markup:
    titles: list[Child] = [tag("th", head, scope="col") for head in heads]
    return scrolled(name, tag("thead", tag("tr", *titles)), tag("tbody", *rows), class_="figures")


def _pixels(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else "–"
