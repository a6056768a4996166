"""A self-contained HTML file without scripts, fonts or links, the same bytes for the same content."""

from functools import cache
from pathlib import Path

from app.report.markup import Markup, tag

__all__ = ["html_file"]

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def html_file(title: str, body: Markup) -> str:
    """Return a whole file that is well-formed XML, too.

    Args:
        title: for the window.
        body: the element.
    """
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        Markup(f"<style>{_style()}</style>"),
    )
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en', xmlns='http://www.w3.org/1999/xhtml').text}\n"


@cache
def _style() -> str:
    return Path(__file__).with_name("report.css").read_text(encoding="utf-8")
