"""Parse times and dates in file names, columns and options, without floating point, and format them as text."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation
from typing import Literal

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs

DATE_SPELLINGS: tuple[str, ...] = (
    "2024-05-17T09:42:31.208764Z", "2024-05-17T11:42:31.208764+02:00", "2024-05-17 09:42:31.208764",
    "2024/05/17/09:42:31.208764", "2024/05/17 09:42:31.208764", "17.05.2024 09:42:31.208764", "2024-05-17_09-42-31-208764",
    "2024-05-17-09-42-31_208764", "2024_05_17_09_42_31_208764", "20240517_094231_208764", "20240517T094231.208764Z",
    "20240517-094231-208764", "20240517094231208764", "2024-05-17T09.42.31.208764Z", "2024-05-17_09h42m31s208764",
)  # fmt: skip
"""One moment in every spelling that is read, with six digits of the second; three and nine are read as well, and none."""
_DATE = (
    r"(?<!\d)(?:(?P<year>19\d\d|20\d\d)(?P<a>[-_/.: ]?)(?P<month>0[1-9]|1[0-2])(?P=a)(?P<day>0[1-9]|[12]\d|3[01])"
    r"|(?P<day_first>0[1-9]|[12]\d|3[01])\.(?P<month_second>0[1-9]|1[0-2])\.(?P<year_last>19\d\d|20\d\d))"
)
_CLOCK = (
    r"(?:[T _/.:@-]{0,3}| at )(?P<hour>[01]\d|2[0-3])(?:(?P<b>[-_.: ]?)(?P<minute>[0-5]\d)(?P=b)(?P<second>[0-5]\d)"
    r"|h(?P<minute_m>[0-5]\d)m(?P<second_s>[0-5]\d)s?)"
)
_NO_DATE = r"(?![-_: ]?(?:19|20)\d\d(?P<c>[-_/.: ]?)(?:0[1-9]|1[0-2])(?P=c)(?:0[1-9]|[12]\d|3[01])(?!\d))"
_TAIL = (  # -07:00, and -0700 after a clock with colons, is a zone
    r"(?:(?P<point>[.,])(?P<fraction>\d{1,12})"
    r"|" + _NO_DATE + r"(?!-\d\d:\d\d|(?<=:\d\d)-\d{4}(?!\d))[-_: ]?(?P<digits>\d{1,9})(?P<unit>ms|us|ns)?)?(?!\d)"
)
_ZONE = r"(?P<zone> ?(?:Z|UTC)(?![A-Za-z+-])| ?(?:UTC)?[+-]\d\d:?\d\d(?!\d))?"
_MOMENT = re.compile(_DATE + _CLOCK + _TAIL + _ZONE, re.ASCII)
_OFFSET = re.compile(r"(?:UTC)?([+-])(\d\d):?(\d\d)", re.ASCII)
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


@dataclass(frozen=True, slots=True)
class WrittenMoment:
    """A time as a name or cell writes it.

    Attributes:
        second: whole seconds since 1970; in UTC if zoned, otherwise as if the zone were UTC.
        tail: the digits after the second; "" if there are none.
        exact: whether the tail is a decimal fraction beyond doubt: it follows a point.
        zoned: whether a zone is given. An epoch number always is.
        span: where it is written.
    """

    second: int
    tail: str = ""
    exact: bool = True
    zoned: bool = True
    span: tuple[int, int] = (0, 0)

    @property
    def time(self) -> TimeNs:
        """The time if the tail is a decimal fraction."""
        return TimeNs(self.second * NS_PER_S + int(self.tail[:9].ljust(9, "0")))


def moments_in(text: str) -> Iterator[WrittenMoment]:
    """Yield every date with a time of day in a text."""
    for match in _MOMENT.finditer(text):
        part = match.groupdict()
        try:
            moment = datetime(
                int(part["year"] or part["year_last"]),
                int(part["month"] or part["month_second"]),
                int(part["day"] or part["day_first"]),
                int(part["hour"]),
                int(part["minute"] or part["minute_m"]),
                int(part["second"] or part["second_s"]),
                tzinfo=UTC,
            )
            zone = (part["zone"] or "").strip()
            second = (moment - _EPOCH) // timedelta(seconds=1) - (zone_of(zone) if zone else 0)
        except ValueError:
            continue
        wanted = {"ms": 3, "us": 6, "ns": 9}.get(part["unit"] or "", 0)
        digits = (part["digits"] or "").rjust(wanted, "0")  # 5ms is 005
        yield WrittenMoment(
            second, part["fraction"] or digits, bool(part["point"] or part["unit"] or not digits), bool(zone), match.span()
        )  # fmt: skip


def date_text(text: str) -> WrittenMoment | None:
    """Return the date that makes up a whole text; None if it is anything else.

    A tail after a dash, colon or underscore is a fraction only if it has 3, 6 or 9 digits.
    """
    text = text.strip()
    for moment in moments_in(text):
        if moment.span == (0, len(text)) and (moment.exact or len(moment.tail) in (3, 6, 9)):
            return moment
    return None


def zone_of(zone: str) -> int:
    """Return a zone's offset from UTC [s].

    Raises:
        ValueError: it is not written as Z, UTC or +02:00.
    """
    if zone.upper() in ("Z", "UTC"):
        return 0
    match = _OFFSET.fullmatch(zone.strip())
    if match is None or int(match[3]) > 59 or int(match[2]) > 14:
        raise ValueError(f"'{zone}' is not a time zone")
    seconds = int(match[2]) * 3600 + int(match[3]) * 60
    return -seconds if match[1] == "-" else seconds


def parse_zone(text: str | None) -> int | None:
    """Return the value of --time-zone as an offset from UTC [s].

    Raises:
        RecordingError: it is not a zone.
    """
    if text is None:
        return None
    try:
        return zone_of(text.strip())
    except ValueError:
        raise RecordingError(f"--time-zone {text}: give an offset from UTC such as +02:00, or UTC") from None


_YEAR_S = 365 * 86_400


def utc(time: TimeNs) -> str:
    """Format a stamp as UTC date and time with milliseconds; as seconds if it counts from a start of its own, not from 1970."""
    seconds, rest = divmod(int(time), NS_PER_S)
    if seconds < _YEAR_S:
        return f"{seconds}.{rest // 1_000_000:03d} s"
    try:
        moment = datetime.fromtimestamp(seconds, tz=UTC)
    except (OverflowError, ValueError, OSError):
        return f"{seconds}.{rest // 1_000_000:03d} s"
    return f"{moment:%Y-%m-%d %H:%M:%S}.{rest // 1_000_000:03d} UTC"


def span_text(seconds: float) -> str:
    """Format a time difference in seconds, minutes, hours or days."""
    seconds = abs(seconds)
    for size, unit in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.3f} s"


def epoch_in_name(stem: str) -> WrittenMoment | None:
    """Find the time since 1970 in a file's name: 19 digits are ns, 16 us, 13 ms, 10 s, with a fraction or without.

    If a name has several numbers, the last one that is a time between 2001 and 2100 is used.
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
