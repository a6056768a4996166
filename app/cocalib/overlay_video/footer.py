"""The strip below the pictures: time, Acc, what is shown, and what the colours of returns mean."""

from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from calib_core.measurements import NS_PER_S, TimeNs
from cocalib.colours import RETURN_RAMPS
from cocalib.overlay_video.marks import label, label_width_px
from cocalib.recorded_view import ReturnColours

_BACKGROUND = (20, 16, 13)
_TITLE_FROM = 0.5
"""A title has room between this share of the width and the legend; a longer one is left out."""
_INK, _DIM = (240, 236, 232), (164, 152, 140)


def footer_height_px(picture_height_px: int) -> int:
    """Return how high the strip is below a picture, so that both together have an even height."""
    height = max(30, round(0.055 * picture_height_px))
    return height + (picture_height_px + height) % 2


def time_text(time: TimeNs, start: TimeNs) -> str:
    """Write a stamp as date and time (UTC) to a millisecond, and the seconds since the first frame."""
    day = datetime.fromtimestamp(time // NS_PER_S, UTC)
    return f"{day:%Y-%m-%d %H:%M:%S}.{time % NS_PER_S // 10**6:03d} UTC   +{(time - start) / NS_PER_S:.2f} s"


def footers(width_px: int, height_px: int, colours: ReturnColours, titles: Sequence[str]) -> list[np.ndarray]:
    """Return the strips of the panels, without what changes: titles in the right half, the legend at the end.

    Args:
        width_px: of a panel.
        height_px: of the strip.
        colours: of the returns.
        titles: one per panel.
    """
    strips = [np.full((height_px, width_px, 3), _BACKGROUND, np.uint8) for _ in titles]
    for strip, title in zip(strips, titles, strict=True):
        left = _legend(strip, colours)
        if title:
            letters = _letters(strip)
            width = label_width_px(title, letters)
            if width < left - _TITLE_FROM * width_px:
                label(strip, title, (left - width - letters, _base_line(strip)), _DIM, letters)
    return strips


def write_changing(strip: np.ndarray, words: str) -> None:
    """Write what changes from frame to frame at the left end of a strip."""
    letters = _letters(strip)
    label(strip, words, (letters, _base_line(strip)), _INK, letters)


def _letters(strip: np.ndarray) -> float:
    """Return the height of capital letters [px] that fits the strip and its width."""
    return min(0.34 * strip.shape[0], strip.shape[1] / 90.0)


def _base_line(strip: np.ndarray) -> float:
    return 0.5 * strip.shape[0] + 0.5 * _letters(strip)


def _legend(strip: np.ndarray, colours: ReturnColours) -> float:
    """Draw the ramp between its two ends; return where it begins [px]."""
    height, width = strip.shape[:2]
    letters = _letters(strip)
    low, high = colours.ends
    ramp = np.array(RETURN_RAMPS["signed" if colours.quantity == "speed" else "rising", False], dtype=np.float64)
    bar_px = max(40, width // 12)
    shares = np.linspace(0.0, 1.0, bar_px)
    stops = np.linspace(0.0, 1.0, len(ramp))
    row = np.stack([np.interp(shares, stops, channel) for channel in ramp[:, ::-1].T], axis=1)
    right = width - round(letters)
    high_px = round(label_width_px(high, letters))
    bar_right = right - high_px - round(0.6 * letters)
    top, bottom = round(0.36 * height), round(0.64 * height)
    strip[top:bottom, bar_right - bar_px : bar_right] = np.rint(row).astype(np.uint8)
    label(strip, high, (right - high_px, _base_line(strip)), _DIM, letters)
    low_px = bar_right - bar_px - round(0.6 * letters) - round(label_width_px(low, letters))
    label(strip, low, (low_px, _base_line(strip)), _DIM, letters)
    return float(low_px - letters)
