"""The report on a lens, from the figures to be judged to everything that was measured."""

from calib_core.interchange.own.board_views_json import PictureSource
from calib_core.intrinsics import CalibratedLens
from calib_core.intrinsics.coverage import Coverage
from cocalib.intrinsics.field_of_view import field_of_view_text
from cocalib.report.html_file import html_file
from cocalib.report.lens.over_the_picture import residuals_over_the_picture, uncertainty_over_the_picture
from cocalib.report.lens.tables import left_out_table, model_table, parameter_table, view_table, warning_list
from cocalib.report.lens.views import coverage_of_views, errors_of_views
from cocalib.report.markup import Markup, tag


def lens_report_html(lens: CalibratedLens, source: PictureSource, coverage: Coverage, *, searched: int) -> str:
    """Return the report as HTML that is well-formed XML, too; the same lens gives the same bytes.

    Args:
        lens: with its views.
        source: of the pictures.
        coverage: of the used views.
        searched: how many pictures were looked at.
    """
    body = tag(
        "body",
        tag("header", tag("h1", "Camera lens report"), tag("p", tag("b", source.name), f", {_board_text(lens)}")),
        tag(
            "main",
            _answer(lens, searched),
            warning_list(lens),
            uncertainty_over_the_picture(lens),
            residuals_over_the_picture(lens),
            coverage_of_views(lens, coverage),
            errors_of_views(lens),
            view_table(lens),
            left_out_table(lens),
        ),
        tag("footer", _foot()),
    )
    return html_file(f"Camera lens report: {source.name}", body)


def _answer(lens: CalibratedLens, searched: int) -> Markup:
    camera = lens.camera
    said = (
        f"{camera.model}, {camera.width_px} x {camera.height_px} px, field of view {field_of_view_text(camera)}. "
        f"RMS {lens.rms_px:.3f} px in {len(lens.views)} used views, {lens.held_out_rms_px:.3f} px in views left out in turn; "
        f"{searched} pictures searched, {len(lens.left_out)} left out."
    )
    return tag(
        "section",
        tag("h2", "The lens"),
        tag("p", said),
        tag("div", parameter_table(lens), model_table(lens), class_="two"),
        id="lens",
    )


def _board_text(lens: CalibratedLens) -> str:
    return f"{lens.board.text}, {1e3 * lens.board.square_m:g} mm"


def _foot() -> str:
    return (
        "Pixel (0, 0) is the centre of the top-left pixel. Sigma is one standard deviation. Held out: with the lens calibrated "
        "without that view. The same pictures give the same file, byte for byte."
    )
