"""Words for the screen: sentences from phrases of the core, numbers to their meaningful digits, places as people say them."""

import math

from calib_core.arrays import Vector3
from calib_core.radar import polar_from_cartesian
from calib_core.words.text import sentence as in_sentence


def sentence(phrase: str) -> str:
    """Return a phrase as a sentence; see `calib_core.words.sentence`."""
    return str(in_sentence(phrase))


_STRAIGHT_DEG = 0.05


def position_words(position_radar_m: Vector3) -> str:
    """Return where a position (3,) [m] is, as seen from the radar: "20.0 m, 2.5° right, 0.4° down"."""
    range_m, azimuth, elevation = polar_from_cartesian(position_radar_m[None])[0].tolist()
    return ", ".join(
        (
            f"{range_m:.1f} m",
            direction_words(math.degrees(azimuth), "left", "right"),
            direction_words(math.degrees(elevation), "up", "down"),
        )
    )


def direction_words(angle_deg: float, positive: str, negative: str) -> str:
    """Return an angle with its side: "2.5° right"; an angle that rounds to zero has none: "0.0°"."""
    if abs(angle_deg) < _STRAIGHT_DEG:
        return "0.0°"
    return f"{abs(angle_deg):.1f}° {positive if angle_deg > 0 else negative}"


_DASH = "–"


def plain(value: float, digits: int = 3) -> str:
    """Format a number with this many significant digits, more only before the decimal point; a dash if it is not finite."""
    if not math.isfinite(value):
        return _DASH
    if value == 0:
        return "0"
    return _fixed(value, max(0, digits - 1 - _exponent(value, digits)))


def with_sigma(value: float, sigma: float) -> str:
    """Format a number and its standard deviation with the same number of decimals: "0.31 ± 0.08".

    The standard deviation gets two digits if these are 10 to 35, and one digit above that, as is usual in physics.
    """
    if not math.isfinite(value):
        return _DASH
    if not math.isfinite(sigma) or sigma <= 0:
        return plain(value)
    exponent = _exponent(sigma, 3)
    leading = round(sigma / 10.0**exponent * 100)
    digits = 2 if leading <= 354 or leading >= 950 else 1
    exponent += leading >= 950
    decimals = digits - 1 - exponent
    return f"{_fixed(value, decimals)} ± {_fixed(sigma, decimals)}"


def _exponent(value: float, digits: int) -> int:
    """Return the power of ten of the first digit, after rounding to this many digits."""
    return int(f"{abs(value):.{digits - 1}e}".partition("e")[2])


def _fixed(value: float, decimals: int) -> str:
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    return text[1:] if text.startswith("-") and not any(digit in text for digit in "123456789") else text
