"""What of a pose's covariance rests on stated standard deviations, and not on how the pairs scatter."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, frozen_array

_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class CovarianceParts:
    """Two parts of a pose's covariance; what is left over is the scatter of the pairs. Their sum is at most the covariance.

    Attributes:
        systematic: (6, 6) from the errors that all pairs share, of radar, lens and clicks: another session with these sensors
            has them again.
        camera_position: (6, 6) from the measured camera position: another session has it again only if it is not measured anew;
            zeros without one.
    """

    systematic: Matrix66
    camera_position: Matrix66

    def __post_init__(self) -> None:
        object.__setattr__(self, "systematic", frozen_array(self.systematic, (6, 6)))
        object.__setattr__(self, "camera_position", frozen_array(self.camera_position, (6, 6)))

    def within(self, covariance: Matrix66) -> "CovarianceParts":
        """Return the parts, made smaller by one factor if together they exceed a covariance (6, 6) along any axis.

        They are those of the fit; of a posterior that is not normal, the covariance is another one.
        """
        scale = np.sqrt(np.diag(covariance))
        values, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
        whitening = (axes / np.sqrt(np.maximum(values, _ROUNDING))).T / scale
        largest = float(np.linalg.eigvalsh(whitening @ (self.systematic + self.camera_position) @ whitening.T)[-1])
        if largest <= 1.0:
            return self
        return CovarianceParts(self.systematic / largest, self.camera_position / largest)
