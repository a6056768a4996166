"""What three witnesses say together: has the camera turned against the radar since the baseline?

The still image says how the camera turned in the world, the still returns how the radar did, and traffic how they turned
against each other. A turn is about x, y and z of the camera (pitch, yaw, roll), and about those of the radar for its own.
"""

from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

import numpy as np

from calib_core.arrays import Matrix33, Values, Vector3, freeze
from calib_core.measurements import TimeNs

AXES: Final = ("pitch", "yaw", "roll")
"""About x, y and z of the camera."""

Finding: TypeAlias = Literal[
    "turned", "radar_turned", "mast_turned", "camera_moved", "traffic_denies", "nothing", "too_little"
]
"""Camera and radar turned against each other; the radar alone is seen to have turned; both turned alike; the camera moved and
the radar is not seen; the camera moved, and traffic, which would show it, does not; nothing, with enough power; too little."""

SLIPPED: Final = ("turned", "radar_turned")
HOLDS: Final = ("nothing", "mast_turned")

_NINETY_FIVE_OF_ONE_SIDE = 1.645
_ENOUGH_RAD = np.deg2rad(1.0)
_RELATIVE_SIGMAS, _RELATIVE_RAD = 5.0, np.deg2rad(0.1)


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """A rotation between two times, as small angles about x, y and z of a sensor's own axes.

    Attributes:
        rotation_rad: (3,) of what the sensor sees; a point p moves to Exp(rotation) p.
        covariance_rad2: (3, 3).
        determined: whether it is, about each axis: a radar without elevation sees turns about its vertical only.
    """

    rotation_rad: Vector3
    covariance_rad2: Matrix33
    determined: tuple[bool, bool, bool] = field(default=(True, True, True), kw_only=True)

    def __post_init__(self) -> None:
        freeze(self, rotation_rad=(3,), covariance_rad2=(3, 3))


@dataclass(frozen=True, slots=True, eq=False)
class SeenTurn(Turn):
    """What a witness says of a turn since the baseline.

    Attributes:
        least_rad: (3,) smallest turn about each axis that counts; infinite about an axis that is not determined.
        turned: (3,) whether one is seen.
        since: the beginning of the first stretch or window that shows it; None if nothing turned.
        range_m: median range of what it is seen in; NaN if unknown.
        passages: of traffic that it rests on; 0 for other witnesses.
        late_s: by how much later the images are stamped against the scans than in the baseline, and its standard deviation;
            None where no traffic crosses.
    """

    least_rad: Vector3
    turned: np.ndarray
    since: TimeNs | None = None
    range_m: float = float("nan")
    passages: int = 0
    late_s: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        Turn.__post_init__(self)
        freeze(self, least_rad=(3,))
        freeze(self, np.bool_, turned=(3,))

    @property
    def sigma_rad(self) -> Values:
        """Standard deviations (3,)."""
        return np.sqrt(np.diag(self.covariance_rad2))

    @property
    def noticed_rad(self) -> Values:
        """The turn about each axis (3,) that would have been noticed 95 times of 100."""
        return np.asarray(self.least_rad + _NINETY_FIVE_OF_ONE_SIDE * self.sigma_rad)


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What all witnesses say together.

    Attributes:
        finding: in one word.
        change: of the camera against the radar, by the witness or witnesses that show it; None if none could.
        noticed_rad: (3,) the turn of camera against radar about pitch, yaw and roll that would have been noticed.
        image: the still image.
        returns: the still returns, about the radar's axes.
        traffic: matched targets and boxes.
    """

    finding: Finding
    change: SeenTurn | None
    noticed_rad: Values
    image: SeenTurn | None = None
    returns: SeenTurn | None = None
    traffic: SeenTurn | None = None


def verdict_of(
    image: SeenTurn | None,
    returns: SeenTurn | None,
    traffic: SeenTurn | None,
    *,
    camera_from_radar_rotation: Matrix33,
) -> Verdict:
    """Weigh the witnesses; None stands for one that is not there."""
    relative = None if image is None or returns is None else _relative(image, returns, camera_from_radar_rotation)
    known = [one.noticed_rad for one in (relative, traffic) if one is not None]
    noticed = np.min([np.full(3, np.inf), *known], axis=0)
    finding, change = _finding(image, returns, traffic, relative, noticed)
    return Verdict(finding, change, noticed, image, returns, traffic)


def _finding(
    image: SeenTurn | None,
    returns: SeenTurn | None,
    traffic: SeenTurn | None,
    relative: SeenTurn | None,
    noticed: Values,
) -> tuple[Finding, SeenTurn | None]:
    best = min(
        (one for one in (relative, traffic) if one is not None),
        key=lambda one: (not one.turned.any(), float(np.trace(one.covariance_rad2[:2, :2]))),
        default=None,
    )
    if best is not None and best.turned.any():
        return "turned", best
    if image is None and returns is not None and returns.turned.any():
        return "radar_turned", None
    if image is not None and image.turned.any():
        return _of_the_camera(image, traffic, relative), best
    enough = bool((noticed[:2] <= _ENOUGH_RAD).all())
    return "nothing" if enough else "too_little", best


def _of_the_camera(image: SeenTurn, traffic: SeenTurn | None, relative: SeenTurn | None) -> Finding:
    """Say what it means that the camera turned in the world, and nothing shows that it turned against the radar."""
    size = np.where(image.turned, np.abs(image.rotation_rad), 0.0)
    if (
        relative is not None
        and (np.where(image.turned, relative.noticed_rad, 0.0) <= np.maximum(size, _RELATIVE_RAD)).all()
    ):
        return "mast_turned"
    if traffic is not None and (np.where(image.turned, traffic.noticed_rad, 0.0) <= size).all():
        return "traffic_denies"
    return "camera_moved"


def _relative(image: SeenTurn, returns: SeenTurn, rotation: Matrix33) -> SeenTurn:
    """Return the turn of the camera against the radar from those of both in the world.

    A radar without elevation says nothing of its own pitch and roll: only the part about its vertical is determined, and it is
    stated about the camera's axis that is nearest to that.
    """
    seen = np.isfinite(returns.least_rad)
    if seen.all():
        turn = image.rotation_rad - rotation @ returns.rotation_rad
        covariance = image.covariance_rad2 + rotation @ returns.covariance_rad2 @ rotation.T
        least = np.maximum(_RELATIVE_SIGMAS * np.sqrt(np.diag(covariance)), _RELATIVE_RAD)
    else:
        vertical = rotation[:, 2]
        axis = int(np.abs(vertical).argmax())
        way = np.sign(vertical[axis])
        turn, covariance, least = np.zeros(3), np.diag(np.full(3, np.inf)), np.full(3, np.inf)
        turn[axis] = way * (vertical @ image.rotation_rad - returns.rotation_rad[2])
        covariance[axis, axis] = vertical @ image.covariance_rad2 @ vertical + returns.covariance_rad2[2, 2]
        least[axis] = max(_RELATIVE_SIGMAS * float(np.sqrt(covariance[axis, axis])), _RELATIVE_RAD)
    since = [one.since for one in (image, returns) if one.since is not None]
    return SeenTurn(turn, covariance, least, np.abs(turn) > least, min(since, default=None))
