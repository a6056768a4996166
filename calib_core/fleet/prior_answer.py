"""What a fleet's prior does to a calibration: the test of the data alone against it, and what the user must know."""

import numpy as np

from calib_core.fleet.deviation import Deviation
from calib_core.fleet.prior_test import prior_test
from calib_core.fleet_prior import DataAlone, FleetAnswer, FleetPrior
from calib_core.measurements import Unsolvable
from calib_core.results import Calibration, DataWarning
from calib_core.stated_error import stated_error

_RARE = 0.01
"""A sound vehicle is this far from the prior, or farther, less often than this: the prior then draws the pose of an odd one."""
_UNTESTED_DEG = 9.0
"""Three times what is usable: data that state more do not test the prior."""
_DECIDES = 1.25
"""The prior decides if the data alone state an error this many times as large, of rotation or position."""


def fleet_answer(
    prior: FleetPrior, alone: Calibration | Unsolvable, verdict: str = "", reason: str = ""
) -> FleetAnswer:
    """Test the answer of the data alone against the fleet's prior.

    Args:
        prior: of the vehicle's type, without this vehicle.
        alone: the answer without the prior, or why there is none.
        verdict: the level of the verdict on it.
        reason: of that verdict.
    """
    if isinstance(alone, Unsolvable) or not np.isfinite(alone.covariance).all():
        return FleetAnswer(prior, used=True, data_alone=None)
    data = DataAlone(
        alone.camera_from_radar,
        alone.covariance,
        alone.covariance_quantile,
        verdict,
        reason,
        alone.covariance_parts,
    )
    away = prior_test(prior, data)
    return FleetAnswer(prior, not away.is_beyond, data, away.squared, away.limit)


def fleet_warnings(fleet: FleetAnswer, calibration: Calibration) -> tuple[DataWarning, ...]:
    """Say what the fleet's prior means for an answer.

    Args:
        fleet: what it did.
        calibration: the answer; its own warnings do not matter.
    """
    kind = fleet.prior.vehicle_type
    if fleet.data_alone is None:
        return (
            DataWarning(
                "fleet-prior-untested",
                f"the data alone give no pose, so nothing tests whether this vehicle is of type {kind}; the fleet's "
                "prior decides the pose",
                "add placements until the data alone give a pose: near and far, left and right",
            ),
        )
    away = prior_test(fleet.prior, fleet.data_alone)
    if not fleet.used:
        return (
            DataWarning(
                "off-its-kind",
                f"the data contradict the fleet's prior of type {kind}: {away.text} (squared distance {away.squared:.3g}, "
                f"1-in-10,000 point {away.limit:.3g}); the prior is not used",
                "check that radar, camera, intrinsics and type are this vehicle's; if the mounting really is so, calibrate it "
                "without the fleet's prior",
            ),
        )
    return (*_far(fleet, away), *_decides(fleet, fleet.data_alone, calibration))


def _far(fleet: FleetAnswer, away: Deviation) -> tuple[DataWarning, ...]:
    """Say that the data are farther from the prior than nearly all sound vehicles, though not so far that it is refused."""
    if away.probability >= _RARE:
        return ()
    return (
        DataWarning(
            "far-from-its-kind",
            f"the data are far from the fleet's prior of type {fleet.prior.vehicle_type}: {away.text}; fewer than 1 in 100 "
            "vehicles of this kind are that far off, and the prior would draw the pose of one that is not to the others'",
            "add placements: with more of them the data agree with the fleet, or the vehicle is named as off its kind; and check "
            "that radar, camera, intrinsics and type are this vehicle's",
        ),
    )


def _decides(fleet: FleetAnswer, alone: DataAlone, calibration: Calibration) -> tuple[DataWarning, ...]:
    """Say that the data alone are much less certain, so that a mounting unlike the others would be pulled to them."""
    without = stated_error(calibration.of_data_alone(alone))
    with_prior = stated_error(calibration)
    rotation = without.rotation_deg >= _DECIDES * with_prior.rotation_deg
    position = without.position_cm >= _DECIDES * with_prior.position_cm
    if not (rotation or position):
        return ()
    if without.rotation_deg > _UNTESTED_DEG:
        return (
            DataWarning(
                "fleet-prior-untested",
                f"the data alone are uncertain to {without.rotation_deg:g} deg (95 %), so they hardly test whether this is "
                f"a vehicle of type {fleet.prior.vehicle_type}; the fleet's prior decides the pose",
                "add placements: near and far, left and right",
            ),
        )
    tape = "" if calibration.options.solving.camera_position else ", or measure this vehicle's camera position"
    return (
        DataWarning(
            "fleet-prior-decides",
            f"the pose rests on the fleet's {fleet.prior.named}: the "
            f"data alone are uncertain to {without.rotation_deg:g} deg, {without.position_cm:g} cm (95 %), so a mounting that "
            "differs by less would be drawn to the others' unnoticed",
            f"add placements{tape}: the more the data know, the more they decide",
        ),
    )
