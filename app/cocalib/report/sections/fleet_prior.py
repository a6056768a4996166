"""What the fleet says of this vehicle, what its data alone say, and the answer from both."""

from calib_core.results import Calibration
from cocalib.report.markup import Markup, tag
from cocalib.view.fleet_answer import fleet_axes, fleet_sentences

_HEADS = ("from the fleet's mean", "fleet", "data alone", "answer")
_MOST_NAMED = 12


def fleet_prior(calibration: Calibration) -> Markup | None:
    """Return the three side by side; None without a fleet's prior."""
    axes = fleet_axes(calibration)
    fleet = calibration.fleet
    if fleet is None or not axes:
        return None
    rows = (
        tag(
            "tr",
            tag("th", f"{axis.label} [{axis.unit}]", scope="row"),
            *(tag("td", value or "–") for value in (axis.fleet, axis.alone, axis.answer)),
        )
        for axis in axes
    )
    return tag(
        "section",
        tag("h2", f"With the fleet's prior of type {fleet.prior.vehicle_type}"),
        *(tag("p", words) for words in fleet_sentences(calibration)),
        tag(
            "table",
            tag("thead", tag("tr", *(tag("th", head, scope="col") for head in _HEADS))),
            tag("tbody", *rows),
            class_="figures",
        ),
        tag("p", f"± one standard deviation. The fleet: {_listed(fleet.prior.vehicles)}.", class_="note"),
        id="fleet-prior",
    )


def _listed(names: tuple[str, ...]) -> str:
    shown = ", ".join(names[:_MOST_NAMED])
    return shown if len(names) <= _MOST_NAMED else f"{shown} and {len(names) - _MOST_NAMED} more"
