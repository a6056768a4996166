"""Find dates in file names, columns and options, in the spellings that cameras, loggers and data sets use."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs

DATE_SPELLINGS: tuple[str, ...] = (
    "2024-05-17T09:42:31.208764Z", "2024-05-17T11:42:31.208764+02:00", "2024-05-17 09:42:31.208764",
    "2024/05/17/09:42:31.208764", "2024/05/17 09:42:31.208764", "17.05.2024 09:42:31.208764", "2024-05-17_09-42-31-208764",
    "2024-05-17-09-42-31_208764", "2024_05_17_09_42_31_208764", "20240517_094231_208764", "20240517T094231.208764Z",
    "20240517-094231-208764", "20240517094231208764", "2024-05-17T09.42.31.208764Z", "2024-05-17_09h42m31s208764",
)  # fmt: skip
"""One moment in every spelling that is read, with six digits of the second; three and nine are read as well, and none."""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
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
        digits = _in_nanoseconds(part["digits"], part["unit"])
        yield WrittenMoment(
            second, part["fraction"] or digits, bool(part["point"] or part["unit"] or not digits), bool(zone), match.span()
        )  # fmt: skip


def _in_nanoseconds(digits: str | None, unit: str | None) -> str:
    """Return the digits of a fraction; with a unit, padded to it: 5ms is 005."""
    wanted = {"ms": 3, "us": 6, "ns": 9}.get(unit or "", 0)
    return (digits or "").rjust(wanted, "0")


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
