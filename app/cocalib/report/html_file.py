"""A self-contained HTML file without fonts or requests, the same bytes for the same content."""

import base64
import hashlib
from functools import cache
from pathlib import Path

from cocalib.report.markup import Markup, tag

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def html_file(title: str, body: Markup, *, style: str = "", script: str = "") -> str:
    """Return a whole file that is well-formed XML, too.

    Args:
        title: for the window.
        body: the element.
        style: rules that follow the report's own.
        script: the only one that the page may run; none if empty.
    """
    text = f"//<![CDATA[\n{script}\n//]]>" if script else ""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    policy = f"{_POLICY}; script-src 'sha256-{digest}'" if script else _POLICY
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        Markup(f"<style>{_style()}{style}</style>"),
        Markup(f'<script type="module">{text}</script>') if script else None,
    )
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en', xmlns='http://www.w3.org/1999/xhtml').text}\n"


@cache
def _style() -> str:
    return Path(__file__).with_name("report.css").read_text(encoding="utf-8")
