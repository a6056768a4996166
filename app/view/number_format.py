"""Numbers as people read them: as many digits as the number has earned."""

import math

__all__ = ["plain", "with_sigma"]

_DASH = "–"


def plain(value: float, digits: int = 3) -> str:
    """Write a number with so many digits that count, more only before the point; a dash where it is not finite."""
    if not math.isfinite(value):
        return _DASH
    if value == 0:
        return "0"
    return _fixed(value, max(0, digits - 1 - _exponent(value, digits)))


def with_sigma(value: float, sigma: float) -> str:
    """Write a number and its standard deviation with the same decimals: "0.31 ± 0.08".

    The standard deviation keeps two digits when they begin with 10 to 35 and one digit above, the habit of physicists.
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
    """Return the power of ten of the first digit, after rounding to so many digits."""
    return int(f"{abs(value):.{digits - 1}e}".partition("e")[2])


def _fixed(value: float, decimals: int) -> str:
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    return text[1:] if text.startswith("-") and not any(digit in text for digit in "123456789") else text
