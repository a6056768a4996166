"""The report: one self-contained HTML file that says how good a calibration is, where, and how one knows."""

from cocalib.report.making import against_of, current_report, known_calibration, subject_of, watched
from cocalib.report.page import report_html
from cocalib.report.printing import PrintingError, print_pdf
from cocalib.report.sections.acceptance import limits_met
from cocalib.report.subject import Against, Image, Judged, ReportSubject, Watched

__all__ = [
    "Against",
    "Image",
    "Judged",
    "PrintingError",
    "ReportSubject",
    "Watched",
    "against_of",
    "current_report",
    "known_calibration",
    "limits_met",
    "print_pdf",
    "report_html",
    "subject_of",
    "watched",
]
