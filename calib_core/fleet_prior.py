"""What a fleet says about its next vehicle: where camera and radar of its type are mounted, and how far that scatters."""

from dataclasses import dataclass

from calib_core.arrays import Matrix66, frozen_array
from calib_core.geometry import RigidTransform

__all__ = ["FleetPrior"]


@dataclass(frozen=True, slots=True, eq=False)
class FleetPrior:
    """The distribution of camera_from_radar over the vehicles of one type, as a prior for another one.

    Attributes:
        vehicle_type: its name.
        camera_from_radar: the mean pose of the type.
        covariance: (6, 6) of a further vehicle about that mean: the scatter of the mountings and the uncertainty of the mean
            [m, rad], in the order and convention of `Calibration.covariance`.
        vehicles: names of the vehicles it rests on, in order.
        left_out: names of those that were not counted, in order.
    """

    vehicle_type: str
    camera_from_radar: RigidTransform
    covariance: Matrix66
    vehicles: tuple[str, ...]
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))
