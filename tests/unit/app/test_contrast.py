"""Text can be read on every surface of the page, in both themes."""

import re

import pytest

TEXT = ("ink", "muted", "faint", "accent", "attention")
SURFACES = ("ground", "surface", "raised")
SOFT = ("accent-soft", "attention-soft")
LEAST = 4.5
"""WCAG 2.2, 1.4.3, level AA: for text of normal size."""

Colour = tuple[float, float, float]


def themes(css: str) -> dict[str, dict[str, str]]:
    """Return the variables of both themes; the light one starts from the dark one."""
    blocks = {name: body for name, body in re.findall(r"^(:root|\[data-theme=\"light\"\]) \{(.*?)\}", css, re.M | re.S)}
    dark, light = (dict(re.findall(r"--([\w-]+): ([^;]+);", body)) for body in blocks.values())
    return {"dark": dark, "light": {**dark, **light}}


def parsed(text: str) -> tuple[Colour, float]:
    """Return red, green, blue from 0 to 1, and the opacity."""
    if text.startswith("#"):
        digits = text[1:] if len(text) == 7 else "".join(2 * digit for digit in text[1:])
        red, green, blue = (int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4))
        return (red, green, blue), 1.0
    red, green, blue, percent = (float(number) for number in re.findall(r"[\d.]+", text))
    return (red / 255, green / 255, blue / 255), percent / 100


def over(text: str, below: Colour) -> Colour:
    """Return a colour laid over another."""
    colour, opacity = parsed(text)
    red, green, blue = (opacity * top + (1 - opacity) * under for top, under in zip(colour, below, strict=True))
    return red, green, blue


def luminance(colour: Colour) -> float:
    linear = [each / 12.92 if each <= 0.04045 else ((each + 0.055) / 1.055) ** 2.4 for each in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: Colour, other: Colour) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_of_known_colours():
    assert contrast((0, 0, 0), (1, 1, 1)) == pytest.approx(21)
    assert contrast(parsed("#767676")[0], (1, 1, 1)) == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_text_stands_out_from_everything_that_it_is_on(theme, project_root):
    colours = themes((project_root / "static" / "base" / "look.css").read_text())[theme]
    surface = parsed(colours["surface"])[0]
    below = {name: parsed(colours[name])[0] for name in SURFACES}
    below |= {name: over(colours[name], surface) for name in SOFT}
    below |= {f"veil over {extreme}": over(colours["veil"], (extreme,) * 3) for extreme in (0, 1)}
    weak = {
        (name, place): round(contrast(parsed(colours[name])[0], ground), 2)
        for name in TEXT
        for place, ground in below.items()
        if contrast(parsed(colours[name])[0], ground) < LEAST
    }
    assert weak == {}
