"""Parse times in file names, columns and options, without floating point."""

import re
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation
from typing import Literal

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.time.written_dates import WrittenMoment, date_text

TimeUnit = Literal["ns", "us", "ms", "s"]
_SCALE: dict[TimeUnit, int] = {"ns": 1, "us": 1000, "ms": 1_000_000, "s": NS_PER_S}
_UNIT_OF_DIGITS: dict[int, TimeUnit] = {19: "ns", 16: "us", 13: "ms", 10: "s"}
_NUMBER = re.compile(r"^([+-]?)(\d+)(?:\.(\d*))?$")
_IN_NAME = re.compile(r"(?<!\d)(\d{10})(?:\.(\d{1,9})|[_-](\d{1,9}))(?!\d)|(?<!\d)(\d{19}|\d{16}|\d{13}|\d{10})(?!\d)")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_EXPONENT = re.compile(r"[+-]?\d(?:\.\d*)?[eE]\+?\d{1,2}")
_EPOCHS_NS = (631_152_000 * NS_PER_S, 2_840_140_800 * NS_PER_S)
_SHOWN = 60
_YEARS_NS = (978_307_200 * NS_PER_S, 4_102_444_800 * NS_PER_S)


def time_from_name(stem: str) -> TimeNs | None:
    """Find the time since 1970 in a file's name: 19 digits are ns, 16 us, 13 ms, 10 s, with a fraction or without.

    If a name has several numbers, the last one that is a time between 2001 and 2100 is used.
    """
    found = epoch_in_name(stem)
    return found.time if found is not None else None


def epoch_in_name(stem: str) -> WrittenMoment | None:
    """Find the time since 1970 in a file's name, as time_from_name does, with its digits after the second.

    Ten digits may be followed by a point and a fraction, or by an underscore or dash and digits whose meaning is open.
    """
    found = None
    for match in _IN_NAME.finditer(stem):
        seconds, fraction, tail, digits = match.groups()
        if digits:
            second, nanosec = divmod(int(digits) * _SCALE[_UNIT_OF_DIGITS[len(digits)]], NS_PER_S)
            moment = WrittenMoment(second, f"{nanosec:09d}", span=match.span())
        else:
            moment = WrittenMoment(int(seconds), fraction or tail, bool(fraction), span=match.span())
        if _YEARS_NS[0] <= moment.time <= _YEARS_NS[1]:
            found = moment
    return found


def unit_of_epoch(value: float) -> TimeUnit | None:
    """Return the unit in which a number is a time between 1990 and 2060; None if it is such a time in none of them."""
    return next((unit for unit, scale in _SCALE.items() if _EPOCHS_NS[0] <= value * scale <= _EPOCHS_NS[1]), None)


def read_time(text: str, unit: TimeUnit | None = None, zone_s: int = 0) -> TimeNs:
    """Read a time since 1970 exactly.

    Args:
        text: a number, or a date such as 2024-05-01T12:00:00.25+02:00, in any of DATE_SPELLINGS.
        unit: of the number; if not given, derived from the number of digits.
        zone_s: offset from UTC of dates without a zone [s].

    Raises:
        RecordingError: it is neither.
    """
    text = text.strip()
    match = _NUMBER.match(text) or _NUMBER.match(_without_exponent(text))
    if match is None:
        return _read_date(text, zone_s)
    sign, whole, fraction = match.groups()
    unit = unit or _UNIT_OF_DIGITS.get(len(whole))
    if unit is None and date_text(text) is not None:
        return _read_date(text, zone_s)
    if unit is None:
        raise RecordingError(
            f"'{text}' has {len(whole)} digits, which does not determine its unit; 10 digits mean s, 13 ms, 16 us, 19 ns"
        )
    if len(whole) > 19:
        raise RecordingError(f"'{text[:40]}' has {len(whole)} digits, too many for a time")
    scale = _SCALE[unit]
    digits = (fraction or "").ljust(9, "0")[:9]
    time = (-1 if sign == "-" else 1) * (int(whole) * scale + int(digits) * scale // NS_PER_S)
    if abs(time) >= 1 << 63:
        raise RecordingError(f"'{text}' {unit} is not a valid time; check its unit")
    return TimeNs(time)


def _without_exponent(text: str) -> str:
    """Return 1.7e+18 as 1700000000000000000; any other text unchanged."""
    if not _EXPONENT.fullmatch(text):
        return text
    try:
        return format(Decimal(text), "f")
    except InvalidOperation:
        return text


def _read_date(text: str, zone_s: int) -> TimeNs:
    found = date_text(text)
    if found is not None:
        return TimeNs(found.time - (0 if found.zoned else zone_s * NS_PER_S))
    text = text.removesuffix("Z") + ("+00:00" if text.endswith("Z") else "")
    fraction = re.search(r"\.(\d+)", text)
    try:
        moment = datetime.fromisoformat(re.sub(r"\.\d+", "", text))
    except ValueError as error:
        raise RecordingError(
            f"'{' '.join(text.split())[:_SHOWN]}' is not a time; write seconds since 1970 (1714557600.25) "
            "or a date (2024-05-01T12:00:00.25+02:00)"
        ) from error
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC) - timedelta(seconds=zone_s)
    seconds = (moment - _EPOCH) // timedelta(seconds=1)
    return TimeNs(seconds * NS_PER_S + (int(fraction[1].ljust(9, "0")[:9]) if fraction else 0))
