"""The angle scale of each radar, by its serial, from all its sessions: where it can be told."""

from collections.abc import Iterable
from dataclasses import dataclass

from calib_core.fleet.session_pose import CHI2_95, SessionPose
from calib_core.fleet.tails import FALSE_RATE

_TOLD = 0.5  # of the prior's standard deviation: the sessions say three times as much as the prior


@dataclass(frozen=True, slots=True)
class KnownScale:
    """A scale that the sessions of one radar agree on.

    Attributes:
        value: reported angle over the true one, minus 1.
        sigma: its standard deviation.
        sessions: how many it rests on.
    """

    value: float
    sigma: float
    sessions: int


@dataclass(frozen=True, slots=True)
class RadarScale:
    """The angle scales of one radar.

    Attributes:
        serial: of the radar.
        azimuth: scale of the azimuth; None if it cannot be told, or if the sessions contradict each other.
        elevation: the same of the elevation.
    """

    serial: str
    azimuth: KnownScale | None
    elevation: KnownScale | None


def radar_scales(sessions: Iterable[SessionPose]) -> tuple[RadarScale, ...]:
    """Return the scales of every radar with a known serial, by serial.

    Every session's estimate contains the same prior. It is taken out of each, the sessions are added up, and the prior is put
    back once. A scale is told if that leaves at most half of the prior's standard deviation, and if the sessions agree up to
    the 1-in-10,000 point.

    Args:
        sessions: of any number of radars.
    """
    rows: dict[str, list[SessionPose]] = {}
    for one in sessions:
        if one.radar_serial is not None:
            rows.setdefault(one.radar_serial, []).append(one)
    return tuple(
        RadarScale(serial, _scale(rows[serial], "azimuth_scale"), _scale(rows[serial], "elevation_scale"))
        for serial in sorted(rows)
    )


def _scale(sessions: list[SessionPose], name: str) -> KnownScale | None:
    from scipy.special import chdtri

    measured = [row for one in sessions if (row := _measured(one, name)) is not None]
    if not measured:
        return None
    prior_information = max(row[2] for row in measured)
    own = sum(row[1] for row in measured)
    pull = sum(row[0] * row[1] for row in measured)
    apart = sum(information * (value - pull / own) ** 2 for value, information, _ in measured)
    if len(measured) > 1 and apart > chdtri(len(measured) - 1, FALSE_RATE):
        return None
    sigma = float((own + prior_information) ** -0.5)
    if sigma > _TOLD * float(prior_information**-0.5):
        return None
    return KnownScale(float(pull / (own + prior_information)), sigma, len(measured))


def _measured(session: SessionPose, name: str) -> tuple[float, float, float] | None:
    """Return what the pairs of one session alone say: value, information, and the prior's information; None if nothing."""
    for one in session.angle_scales:
        if one.name == name and 0.0 < one.sigma < one.prior_sigma:
            prior = one.prior_sigma**-2.0
            alone = one.sigma**-2.0 - prior
            heavier = max(1.0, session.quantile / CHI2_95)
            return one.value * one.sigma**-2.0 / alone, alone / heavier, prior
    return None
