"""The summary page: one static HTML file that says where every vehicle of a fleet stands."""

from app.fleet.summary_page.page import summary_html

__all__ = ["summary_html"]
