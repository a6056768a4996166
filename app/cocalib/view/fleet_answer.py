"""What a fleet's prior did to a calibration: the fleet, the data alone and the answer side by side."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values
from calib_core.fleet.mounting_coordinates import coordinate_jacobian, coordinates
from calib_core.fleet.prior_test import prior_test
from calib_core.fleet_prior import DataAlone, FleetAnswer
from calib_core.geometry import RigidTransform
from calib_core.pose_difference import pose_difference
from calib_core.results import Calibration
from calib_core.stated_error import StatedError, stated_error
from calib_core.verdict import Verdict, level_named
from cocalib.view.number_format import plain, with_sigma

_UNUSUAL = 0.05
_AXES = ("camera forward", "camera left", "camera up", "roll", "pitch", "yaw")
_TO_SHOWN = np.array([100.0] * 3 + [180.0 / np.pi] * 3)


@dataclass(frozen=True, slots=True)
class FleetAxis:
    """One axis of the mounting, relative to the fleet's mean, each figure with its standard deviation.

    Attributes:
        label: of the axis, in the radar's frame.
        unit: "cm" or "deg".
        fleet: how far a vehicle of this type is expected to be off.
        alone: what the data alone say; "" if they say nothing.
        answer: the pose of the calibration.
    """

    label: str
    unit: str
    fleet: str
    alone: str
    answer: str


def fleet_axes(calibration: Calibration) -> tuple[FleetAxis, ...]:
    """Return the six axes; none without a fleet's prior."""
    fleet = calibration.fleet
    if fleet is None:
        return ()
    mean = fleet.prior.camera_from_radar
    expected = _column(mean, fleet.prior.covariance, mean)
    answer = _column(calibration.camera_from_radar, calibration.covariance, mean)
    data = fleet.data_alone
    alone = ("",) * len(_AXES) if data is None else _column(data.camera_from_radar, data.covariance, mean)
    units = ("cm",) * 3 + ("deg",) * 3
    return tuple(FleetAxis(*row) for row in zip(_AXES, units, expected, alone, answer, strict=True))


def fleet_sentences(calibration: Calibration) -> tuple[str, ...]:
    """Say whether the pose rests on a fleet's prior, and what the data alone say; nothing without one."""
    fleet = calibration.fleet
    if fleet is None:
        return ()
    named = f"the {fleet.prior.named}"
    if fleet.data_alone is None:
        return (f"The pose rests on {named}; the data alone give no pose, so it is not tested.",)
    if not fleet.used:
        return (f"Not used, as the data contradict {named}: {_distance(fleet)}.",)
    away = pose_difference(fleet.data_alone.camera_from_radar, calibration.camera_from_radar, np.full((6, 6), np.nan))
    return (
        f"The pose rests on the data and on {named}: {_error(stated_error(calibration))} (95 %).",
        f"The data alone{_alone(calibration, fleet.data_alone)}.",
        f"They are {plain(away.rotation_deg, 2)} deg and {plain(away.position_cm, 2)} cm from this pose, and "
        f"{_agreement(calibration, fleet.data_alone)}: {_distance(fleet)}.",
    )


def _alone(calibration: Calibration, alone: DataAlone) -> str:
    """Return what the data alone would come to."""
    level = level_named(alone.verdict)
    if level is not None and alone.reason:
        return f" would be {Verdict(level, alone.reason, '').line}"
    return f": {_error(stated_error(calibration.of_data_alone(alone)))} (95 %)"


def _agreement(calibration: Calibration, alone: DataAlone) -> str:
    fleet = calibration.fleet
    if any(warning.code == "far-from-its-kind" for warning in calibration.warnings):
        return "far from the prior, though not beyond the point where they contradict it"
    if fleet is not None and prior_test(fleet.prior, alone).probability < _UNUSUAL:
        return "farther from the prior than 19 of 20 sound vehicles"
    return "agree with the prior"


def _column(pose: RigidTransform, covariance: Matrix66, mean: RigidTransform) -> tuple[str, ...]:
    """Return a pose along the six axes from the fleet's mean, in cm and deg."""
    jacobian = coordinate_jacobian(pose, mean)
    values: Values = coordinates(pose, mean) * _TO_SHOWN
    sigma: Values = np.sqrt(np.diag(jacobian @ covariance @ jacobian.T)) * _TO_SHOWN
    return tuple(with_sigma(value, spread) for value, spread in zip(values.tolist(), sigma.tolist(), strict=True))


def _distance(fleet: FleetAnswer) -> str:
    return f"squared distance {plain(fleet.squared)}, 1-in-10,000 point {plain(fleet.limit)}"


def _error(error: StatedError) -> str:
    """Return what an error says of the pose."""
    return (
        f"{error.rotation_deg:g} deg of yaw"
        if error.in_plane
        else f"{error.rotation_deg:g} deg, {error.position_cm:g} cm"
    )
