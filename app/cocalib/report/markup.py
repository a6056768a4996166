"""Build HTML and SVG from values: all that is not markup already is escaped, so that no text of a file becomes a tag."""

import html
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeAlias

from calib_core.file_tag import TAG

_EMPTY = frozenset(
    {"br", "col", "hr", "image", "img", "line", "link", "meta", "path", "rect", "circle", "polygon", "use"}
)
_REPLACED = {"Cc", "Cs", "Cf", "Co", "Cn", "Zl", "Zp"}
_KEPT_CONTROLS = "\n\t"
_LONGEST = 600
Child: TypeAlias = "Markup | str | None"
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


@dataclass(frozen=True, slots=True)
class Markup:
    """Text that is HTML already.

    Attributes:
        text: well-formed as XML, too.
    """

    text: str


def tag(name: str, /, *children: Child, **attributes: str | float | None) -> Markup:
    """Return an element.

    Args:
        name: of the element.
        children: markup, or text, which is escaped; None is left out.
        attributes: an underscore stands for a hyphen, one at the end is dropped; None is left out.
    """
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_escaped(value if isinstance(value, str) else number(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    if name in _EMPTY and not children:
        return Markup(f"<{name}{given}/>")
    return Markup(f"<{name}{given}>{joined(children).text}</{name}>")


def joined(children: Iterable[Child]) -> Markup:
    """Return several children as one."""
    parts = (child.text if isinstance(child, Markup) else _text(child) for child in children if child is not None)
    return Markup("".join(parts))


def scrolled(name: str, *parts: Child, class_: str) -> Markup:
    """Return a wide table in a frame of its own that scrolls on a narrow screen, also by keyboard."""
    return tag("div", tag("table", *parts, class_=class_), class_="wide", role="region", aria_label=name, tabindex="0")


def number(value: float) -> str:
    """Write a coordinate with at most two decimals."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _text(text: str) -> str:
    """Escape text for reading: none is endless."""
    return _escaped(text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…")


def _escaped(text: str) -> str:
    """Escape text; characters that are invisible or turn the writing direction are replaced."""
    visible = "".join("\N{REPLACEMENT CHARACTER}" if _is_hidden(one) else one for one in text)
    return html.escape(visible, quote=True)


def _is_hidden(character: str) -> bool:
    return unicodedata.category(character) in _REPLACED and character not in _KEPT_CONTROLS


def html_file(title: str, body: Markup) -> str:
    """Return a whole file that is well-formed XML, too.

    Args:
        title: for the window.
        body: the element.
    """
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", name="generator", content=TAG),
        tag("title", title),
        Markup(f"<style>{_style()}</style>"),
    )
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en', xmlns='http://www.w3.org/1999/xhtml').text}\n"


@cache
def _style() -> str:
    return Path(__file__).with_name("report.css").read_text(encoding="utf-8")
