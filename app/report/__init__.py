"""The report: one self-contained HTML file that says how good a calibration is, where, and how one knows."""

from app.report.current_report import current_report
from app.report.making import against_of, known_calibration, subject_of
from app.report.page import report_html
from app.report.printing import PrintingError, print_pdf
from app.report.subject import Against, Judged, Picture, ReportSubject, Watched
from app.report.watching import watched

__all__ = [
    "Against",
    "Judged",
    "Picture",
    "PrintingError",
    "ReportSubject",
    "Watched",
    "against_of",
    "current_report",
    "known_calibration",
    "print_pdf",
    "report_html",
    "subject_of",
    "watched",
]
