"""Format numbers with as many digits as are significant."""

import math

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
