"""The report on a lens: one HTML file that says how well it is known, where, and how one knows."""

from cocalib.report.lens.lens_page import lens_report_html

__all__ = ["lens_report_html"]
