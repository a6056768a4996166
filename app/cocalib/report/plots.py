"""Plots as SVG: axes with round ticks, and marks that differ in shape, not in color alone."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from cocalib.report.markup import Child, Markup, joined, number, tag

MarkKind: TypeAlias = Literal["used", "disagrees", "excluded"]
"""A filled circle, a cross, a hollow square."""

_STEPS = (1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, slots=True)
class Axes:
    """A plotting area: from values to places in the drawing.

    Attributes:
        x_low: value at the left edge.
        x_high: at the right edge.
        y_low: at the lower edge.
        y_high: at the upper edge.
        left: of the area in the drawing.
        top: likewise.
        width: likewise.
        height: likewise.
    """

    x_low: float
    x_high: float
    y_low: float
    y_high: float
    left: float = 34.0
    top: float = 8.0
    width: float = 276.0
    height: float = 138.0

    def x(self, value: float) -> float:
        """Return the place of a value on the x axis."""
        return self.left + self.width * (value - self.x_low) / (self.x_high - self.x_low)

    def y(self, value: float) -> float:
        """Return the place of a value on the y axis."""
        return self.top + self.height * (self.y_high - value) / (self.y_high - self.y_low)

    def drawn(self, x_label: str, y_label: str, *, x_percent: bool = False, y_percent: bool = False) -> Markup:
        """Return the frame, its ticks with their numbers, and what the axes show."""
        bottom = self.top + self.height
        x_ticks = ((self.x(at), _tick(at, percent=x_percent)) for at in ticks(self.x_low, self.x_high))
        y_ticks = ((self.y(at), _tick(at, percent=y_percent)) for at in ticks(self.y_low, self.y_high, count=4))
        return tag(
            "g",
            tag("rect", x=self.left, y=self.top, width=self.width, height=self.height, class_="frame"),
            *(
                joined(
                    (
                        tag("line", x1=at, x2=at, y1=bottom, y2=bottom + 3, class_="axis"),
                        text(at, bottom + 13, label, class_="middle"),
                    )
                )
                for at, label in x_ticks
            ),
            *(
                joined(
                    (
                        tag("line", x1=self.left, x2=self.left + self.width, y1=at, y2=at, class_="grid"),
                        text(self.left - 4, at + 3.5, label, class_="end"),
                    )
                )
                for at, label in y_ticks
            ),
            text(self.left + self.width / 2, bottom + 26, x_label, class_="middle"),
            tag(
                "text",
                y_label,
                transform=f"translate(9 {number(self.top + self.height / 2)}) rotate(-90)",
                class_="middle",
            ),
        )


def ticks(low: float, high: float, *, count: int = 6) -> list[float]:
    """Return round values between two in either order, about this many."""
    low, high = min(low, high), max(low, high)
    step = rounded_step((high - low) / count)
    return [
        round(index * step, 9)
        for index in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)
    ]


def rounded_step(least: float) -> float:
    """Return the smallest of 1, 2, 5 times a power of ten that is not below this."""
    power = 10.0 ** np.floor(np.log10(max(least, 1e-12)))
    return float(next(step * power for step in _STEPS if step * power >= least * (1.0 - 1e-9)))


def _tick(value: float, *, percent: bool) -> str:
    return f"{100.0 * value:.6g}" if percent else f"{value:.6g}"


def text(x: float, y: float, words: str, *, class_: str | None = None) -> Markup:
    """Return text at a place."""
    return tag("text", words, x=x, y=y, class_=class_)


def mark(kind: MarkKind, x: float, y: float) -> Markup:
    """Return a mark whose shape says what became of the pair."""
    if kind == "used":
        return tag("circle", cx=x, cy=y, r=2.6, class_="used")
    if kind == "disagrees":
        left, right, top, bottom = (number(at) for at in (x - 3, x + 3, y - 3, y + 3))
        return tag("path", d=f"M{left} {top}L{right} {bottom}M{left} {bottom}L{right} {top}", class_="disagrees")
    return tag("rect", x=x - 2.5, y=y - 2.5, width=5.0, height=5.0, class_="excluded")


def polyline(points: Iterable[Sequence[float]], *, class_: str) -> Markup:
    """Return a line through points (x, y)."""
    return tag("path", d="M" + "L".join(f"{number(x)} {number(y)}" for x, y in points), class_=class_)


def drawing(alternative: str, *children: Child, width: float = 320.0, height: float = 176.0) -> Markup:
    """Return a drawing with the text that stands for it."""
    return tag(
        "svg",
        tag("title", alternative),
        *children,
        role="img",
        viewBox=f"0 0 {number(width)} {number(height)}",
        xmlns="http://www.w3.org/2000/svg",
    )


def captioned(heading: str, drawn: Markup, words: str = "") -> Markup:
    """Return a drawing under its heading, with the sentence that says what to see, if there is one."""
    return tag("figure", tag("h3", heading), drawn, tag("figcaption", words) if words else None)
