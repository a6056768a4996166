"""The summary page: one static HTML file that says where every vehicle of a fleet stands."""

from cocalib.fleet.summary_page.page import SUMMARY_FILE, summary_html, write_summary

__all__ = ["SUMMARY_FILE", "summary_html", "write_summary"]
