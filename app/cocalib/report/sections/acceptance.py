"""Accepted or not: the reader's own limits, if there are any, and room for a name, a date and a signature."""

from dataclasses import dataclass

from calib_core.errors import InputError
from calib_core.results import Calibration
from calib_core.results.verdict import stated_error
from cocalib.report.markup import Markup, tag
from cocalib.report.subject import ReportSubject

_UNITS = {"max-deg": "deg", "max-cm": "cm", "max-px": "px"}
_WORDS = {"max-deg": "rotation", "max-cm": "camera position", "max-px": "reprojection"}
_SIGNED = ("Name", "Date", "Signature", "Remarks")


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit of the reader's, and what is stated.

    Attributes:
        name: "max-deg", "max-cm" or "max-px".
        limit: in its unit.
        stated: what holds with 95 %; NaN or infinite if nothing is stated.
    """

    name: str
    limit: float
    stated: float

    @property
    def met(self) -> bool:
        """Whether the stated error is finite and within the limit."""
        return self.stated <= self.limit


def limits_met(required: tuple[str, ...], calibration: Calibration | None) -> tuple[Limit, ...]:
    """Compare the stated error with limits.

    Args:
        required: such as "max-deg=1".
        calibration: None if no camera is known: nothing is stated then.

    Raises:
        InputError: a text is no limit.
    """
    error = None if calibration is None else stated_error(calibration)
    stated = {} if error is None else {"deg": error.rotation_deg, "cm": error.position_cm, "px": error.image_px}
    found = []
    for text in required:
        name, _, value = text.partition("=")
        try:
            limit = float(value)
        except ValueError:
            limit = float("nan")
        if name not in _UNITS or not 0.0 < limit < float("inf"):
            raise InputError(
                f"--require {text}: give {', '.join(f'{one}=NUMBER' for one in _UNITS)}, such as max-deg=1"
            )
        found.append(Limit(name, limit, stated.get(_UNITS[name], float("nan"))))
    return tuple(found)


def acceptance(subject: ReportSubject, limits: tuple[Limit, ...]) -> Markup:
    """Return the table of limits and the block to sign."""
    vehicle = subject.found.file.vehicle if subject.found.file is not None else None
    known = [("Vehicle", " ".join(filter(None, (vehicle.name, vehicle.type, vehicle.session))))] if vehicle else []
    rows = [*known, *((name, "") for name in _SIGNED)]
    return tag(
        "section",
        tag("h2", "Acceptance"),
        _table(limits) if limits else tag("p", "No limits were required (--require).", class_="note"),
        tag("dl", *(part for name, value in rows for part in (tag("dt", name), tag("dd", value))), class_="signed"),
        id="acceptance",
    )


def _table(limits: tuple[Limit, ...]) -> Markup:
    body = (
        tag(
            "tr",
            tag("th", _WORDS[limit.name], scope="row"),
            tag("td", f"{limit.limit:g} {_UNITS[limit.name]}"),
            tag("td", f"{limit.stated:g} {_UNITS[limit.name]}" if limit.stated == limit.stated else "not stated"),
            tag("td", tag("b", "pass" if limit.met else "FAIL")),
        )
        for limit in limits
    )
    heads = ("stated error, 95 %", "limit", "stated", "")
    head = tag("thead", tag("tr", *(tag("th", name, scope="col") if name else tag("td") for name in heads)))
    return tag("table", head, tag("tbody", *body), class_="figures")
