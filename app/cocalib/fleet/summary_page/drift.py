"""How far a vehicle's sessions have drifted from its first one, as a small plot."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

from calib_core.fleet import Transition, transition
from cocalib.fleet.records import VehicleRecord
from cocalib.report.markup import Markup, joined, tag
from cocalib.report.plots import Axes, drawing, mark, polyline
from cocalib.view.wording import with_sigma

_WIDTH, _HEIGHT = 128.0, 27.0
_MOST = 2.0
"""The upper edge: a change this many times the limit, and more."""


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """How far each session is from the first one with a pose.

    Attributes:
        changes: from the first to each later one.
        remounted: of each, whether it exceeds both error bars of the session right before it.
    """

    changes: tuple[Transition, ...]
    remounted: tuple[bool, ...]

    @property
    def last(self) -> float | None:
        """The distance of the last session in units of the limit; None with fewer than two sessions."""
        return _height(self.changes[-1]) if self.changes else None


def drift_of(vehicle: VehicleRecord) -> Drift:
    """Return how far a vehicle's sessions are from its first one."""
    first, *later = vehicle.compared or (None,)
    if first is None or not later:
        return Drift((), ())
    steps = [vehicle.transition_to(one.session) for one in later if one is not None]
    changes = tuple(transition(first, one) for one in later if one is not None)
    return Drift(changes, tuple(step is not None and step.is_remount for step in steps))


def drift_plot(drift: Drift, name: str) -> Markup:
    """Return the plot: one mark for each session, and a line beyond which a change exceeds both error bars.

    Args:
        drift: of the vehicle.
        name: of the vehicle.
    """
    if not drift.changes:
        return tag("span", "–")
    axes = Axes(0.0, float(len(drift.changes)), 0.0, _MOST, left=4.0, top=4.0, width=_WIDTH - 8.0, height=_HEIGHT - 7.0)
    heights = [0.0, *(_height(change) for change in drift.changes)]
    places = [(axes.x(index), axes.y(min(height, _MOST))) for index, height in enumerate(heights)]
    limit = tag("line", x1=0.0, x2=_WIDTH, y1=axes.y(1.0), y2=axes.y(1.0), class_="limit")
    return drawing(
        _said(drift, name),
        limit,
        polyline(places, class_="course"),
        _marks(places, (False, *drift.remounted)),
        width=_WIDTH,
        height=_HEIGHT,
    )


def _marks(places: Sequence[tuple[float, float]], remounted: Sequence[bool]) -> Markup:
    """Return a circle for each session, a cross where the radar was remounted."""
    pairs = zip(places, remounted, strict=True)
    return joined(mark("disagrees" if moved else "used", x, y) for (x, y), moved in pairs)


def _said(drift: Drift, name: str) -> str:
    """Say what the plot shows."""
    last = drift.changes[-1]
    rotation = with_sigma(last.rotation_deg, last.rotation_sigma_deg)
    position = with_sigma(last.position_cm, last.position_sigma_cm)
    count = sum(drift.remounted)
    often = f"; remounted {count} time{'' if count == 1 else 's'}" if count else ""
    return f"{name}: {rotation} deg and {position} cm from {last.before.session} to {last.after.session}{often}"


def _height(change: Transition) -> float:
    return sqrt(change.squared / change.limit)
