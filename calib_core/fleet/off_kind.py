"""Is a vehicle off its kind: does its calibration contradict what the others of its type predict?"""

from dataclasses import dataclass

from calib_core.fleet.deviation import Deviation
from calib_core.fleet.mounting_scatter import MountingScatter
from calib_core.fleet.mountings import Mounting
from calib_core.measurements import Unsolvable

_FEW = 12
_USUAL = 12.591587243743977  # the 95 % quantile of chi2 with 6 degrees of freedom


@dataclass(frozen=True, slots=True)
class OffKind:
    """A mounting tested against the others of its type.

    Attributes:
        mounting: what was tested.
        deviation: from what the others predict.
        others: how many mountings these are.
        is_off: whether it is beyond the 1-in-10,000 point.
        words: the outcome with figures, without a full stop.
        hint: what to do; "" if it is not off.
    """

    mounting: Mounting
    deviation: Deviation
    others: int
    is_off: bool
    words: str
    hint: str


def off_kind(mounting: Mounting, scatter: MountingScatter) -> OffKind | Unsolvable:
    """Test one mounting against the other vehicles of its type: none of its own vehicle's mountings counts among them.

    Args:
        mounting: the mounting.
        scatter: of the type, with or without this vehicle.
    """
    others = scatter.without(mounting.vehicle)
    return others if isinstance(others, Unsolvable) else _judged(mounting, others)


def off_kinds(scatter: MountingScatter) -> tuple[OffKind, ...]:
    """Test every mounting of a fleet, counted or left out, each against the other vehicles; in order of vehicle and session.

    In a fleet of more than 12 mountings, one that is within the 95 % point of all of them, its own included, is not tested again
    without it: its own part in the estimate is too small to hide it.
    In a very small fleet, a vehicle without which fewer than 4 mountings are left is not tested; `off_kind` says so of it.

    Args:
        scatter: of the type.
    """
    rows = [*scatter.mountings, *(one.mounting for one in scatter.left_out)]
    found = []
    for mounting in sorted(rows, key=lambda one: (one.vehicle, one.sessions)):
        sound = len(scatter.mountings) > _FEW and scatter.deviation_of(mounting).squared <= _USUAL
        outcome = _judged(mounting, scatter) if sound else off_kind(mounting, scatter)
        if isinstance(outcome, OffKind):
            found.append(outcome)
    return tuple(found)


def _judged(mounting: Mounting, others: MountingScatter) -> OffKind:
    away, count = others.deviation_of(mounting), len(others.mountings)
    figures = f"squared distance {away.squared:.3g}, 1-in-10,000 point {away.limit:.3g}, {count} other mountings"
    if not away.is_beyond:
        return OffKind(mounting, away, count, False, f"{mounting.vehicle} is of its kind ({figures})", "")
    return OffKind(
        mounting,
        away,
        count,
        True,
        f"{mounting.vehicle} is off its kind: {away.text} ({figures})",
        "check that radar, camera and intrinsics are this vehicle's and that the type is right",
    )
