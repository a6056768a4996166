"""A lens model as a value: its mathematics, its coefficients, and its names in the formats of other software."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Points2, Points3, Values

Elsewhere: TypeAlias = Literal["camera_info", "kalibr", "opencv", "colmap", "foxglove"]
"""Formats with their own names for lens models; `camera_info` is ROS's message and its YAML file."""

Project: TypeAlias = Callable[[np.ndarray, Values], tuple[np.ndarray, np.ndarray]]
"""Maps points (..., 3, n) in the camera frame and coefficients to the image plane (..., 2, n) and d plane / d point
(..., 3, 2, n), indexed by coordinate, then row of the plane. NaN for points that the lens does not image."""

Unproject: TypeAlias = Callable[[Points2, Values], Points3]
"""Maps the image plane (n, 2) and coefficients to unit rays (n, 3) in the camera frame. NaN where there is none."""


CoefficientJacobian: TypeAlias = Callable[[np.ndarray, Values], np.ndarray]
"""Maps points (..., 3, n) in the camera frame and coefficients to d plane / d coefficient (..., k, 2, n), for all k
coefficients that the lens model names; those that a camera leaves out are zero."""


@dataclass(frozen=True, slots=True)
class NameElsewhere:
    """A name of a lens model in a format of other software.

    Attributes:
        where: the format.
        name: the lens model's name there.
        coefficients: how many are written with that name; zeros are appended or dropped to reach that number. None means
            as many as the camera has.
    """

    where: Elsewhere
    name: str
    coefficients: int | None = None


@dataclass(frozen=True, slots=True)
class TypicalLens:
    """The simulator's camera for a lens model.

    Attributes:
        distortion: coefficients of a lens with visible distortion.
        field_of_view_deg: horizontal field of view before distortion [deg].
        radius_at: the distance from the centre of the image plane at which a ray at an angle [rad] from the axis
            lands if all coefficients are zero; np.tan for a lens model that is then a pinhole.
    """

    distortion: tuple[float, ...] = ()
    field_of_view_deg: float = 75.0
    radius_at: Callable[[float], float] = np.tan


@dataclass(frozen=True, slots=True, kw_only=True)
class LensModel:
    """A lens model; `registry.LENS_MODELS` lists those that a camera can have.

    The camera matrix is applied to the image plane: pixel = K (plane, 1).

    Attributes:
        name: its name in our files, options and messages.
        coefficients: the names of its distortion coefficients, in the order of `Camera.distortion`.
        counts: how many of them a camera may have, in ascending order; fewer means that the last ones are zero.
        project: from points to the image plane, with the Jacobian.
        unproject: from the image plane to rays.
        coefficient_jacobian: the derivative of the image plane with respect to the coefficients.
        is_perspective: whether it is a pinhole, which keeps straight lines straight, when all coefficients are zero.
        opencv: the function of OpenCV that projects through it, if there is one. cv2.projectPoints distinguishes
            its models by the number of coefficients; so do we if a file names none.
        typical: the simulator's camera.
        names_elsewhere: its names in other formats; if a format has several, the first that can store the coefficients is
            written. A format without one refuses the lens.
        names_in_files: the names, in lower case, that a camera file may use for it.
        names_in_messages: the same for a CameraInfo message; "" is for a message that names no lens model.
    """

    name: str
    coefficients: tuple[str, ...]
    counts: tuple[int, ...]
    project: Project
    unproject: Unproject
    coefficient_jacobian: CoefficientJacobian
    is_perspective: bool
    opencv: Literal["projectPoints", "fisheye.projectPoints"] | None = None
    typical: TypicalLens
    names_elsewhere: tuple[NameElsewhere, ...] = ()
    names_in_files: tuple[str, ...]
    names_in_messages: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.counts or list(self.counts) != sorted(set(self.counts)) or self.counts[0] < 0:
            raise ValueError(f"{self.name}: counts must ascend from 0 or more, got {self.counts}")
        if self.counts[-1] != len(self.coefficients):
            raise ValueError(
                f"{self.name}: {len(self.coefficients)} coefficients are named, but counts ends at {self.counts[-1]}"
            )
        if len(self.typical.distortion) not in self.counts:
            raise ValueError(f"{self.name}: the typical lens has {len(self.typical.distortion)} coefficients")
