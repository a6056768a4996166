"""The report: one HTML file without scripts, fonts or links, the same bytes for the same inputs."""

import base64

from calib_core.results import Calibration
from cocalib.report.markup import Child, Markup, html_file, tag
from cocalib.report.residual_rows import rows_at_clicks, rows_of_pairs
from cocalib.report.sections.acc import acc
from cocalib.report.sections.acceptance import acceptance, limits_met
from cocalib.report.sections.answer import answer
from cocalib.report.sections.cautions import cautions
from cocalib.report.sections.coverage import coverage
from cocalib.report.sections.pairs import pair_table
from cocalib.report.sections.provenance import provenance
from cocalib.report.sections.residuals import residuals
from cocalib.report.sections.uncertainty import uncertainty
from cocalib.report.subject import ReportSubject

_IMAGE_WIDTH = 320.0


def report_html(subject: ReportSubject) -> str:
    """Return the report on a calibration as HTML that is well-formed XML, too."""
    title = f"Calibration report: {subject.name}"
    body = tag(
        "body",
        _definitions(subject),
        tag("header", tag("h1", "Radar-camera calibration report"), tag("p", _what(subject))),
        tag("main", *_sections(subject)),
        tag("footer", _foot()),
    )
    return html_file(title, body)


def _sections(subject: ReportSubject) -> list[Child]:
    """Return the sections in their order; what nothing is known of is left out."""
    shown: list[Child] = [answer(subject), cautions(subject), uncertainty(subject)]
    if subject.calibration is not None:
        shown += _of_pairs(subject, subject.calibration)
    boxes = subject.judged.evaluation.boxes if subject.judged is not None else None
    shown.append(acc(boxes) if boxes is not None else None)
    shown.append(provenance(subject))
    shown.append(acceptance(subject, limits_met(subject.required, subject.calibration)))
    return shown


def _of_pairs(subject: ReportSubject, calibration: Calibration) -> list[Child]:
    """Return residuals, coverage and the table: at the clicks of the recording if it was judged there, else of the own pairs."""
    figures = subject.judged.evaluation.residuals if subject.judged is not None else None
    if figures is not None and subject.judged is not None and subject.recording is not None:
        rows = rows_at_clicks(figures, subject.judged.clicks, calibration)
        known = ", which it was solved from" if rows.solved_from else ""
        of = f"at the clicks in {subject.recording.name}{known}"
    else:
        rows, of = rows_of_pairs(calibration), "of the calibration's own pairs"
    if not len(rows):
        return []
    with_image = subject.recording is not None and subject.recording.image is not None
    return [
        residuals(calibration, rows, of=of, with_image=with_image),
        coverage(calibration, rows, with_image=with_image),
        pair_table(rows),
    ]


def _what(subject: ReportSubject) -> Markup:
    """Say what is reported, in one line."""
    digest = subject.inputs[0].sha256[:16] if subject.inputs else ""
    on = None
    if subject.recording is not None:
        name = subject.recording.name
        nothing = f", with {name}: without further clicks or boxes, judged by its own pairs"
        on = nothing if subject.judged is None else f", judged on {name}"
    known = tag("span", " (sha256 ", tag("code", f"{digest}…"), ")") if digest else None
    return tag("span", tag("b", subject.name), known, on)


def _definitions(subject: ReportSubject) -> Markup | None:
    """Return the frame that several drawings use, once."""
    calibration = subject.calibration
    image = subject.recording.image if subject.recording is not None else None
    if image is None or calibration is None:
        return None
    height = _IMAGE_WIDTH * calibration.camera.height_px / calibration.camera.width_px
    data = f"data:image/jpeg;base64,{base64.b64encode(image.jpeg).decode('ascii')}"
    frame = Markup(
        f'<image id="image" width="{_IMAGE_WIDTH:g}" height="{height:.2f}" preserveAspectRatio="none" href="{data}"/>'
    )
    return tag("svg", tag("defs", frame), class_="definitions", aria_hidden="true", xmlns="http://www.w3.org/2000/svg")


def _foot() -> str:
    return (
        "Radar: x forward, y left, z up. Camera: x right, y down, z forward. Pixel (0, 0) is the center of the top-left pixel. "
        "AED and CDSD divide by N and N - 1. The same inputs give the same file, byte for byte."
    )
