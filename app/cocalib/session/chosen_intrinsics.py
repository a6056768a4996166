"""Intrinsics that a person has chosen for a session: plain numbers, so that two sessions can be compared."""

from dataclasses import dataclass

import numpy as np

from calib_core.camera import Camera, CameraCovariance

Rows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class ChosenIntrinsics:
    """A camera, and where it comes from.

    Attributes:
        about: where it comes from, such as "the board in this recording, 24 views".
        model: name of its lens model.
        size_px: width and height of its pictures.
        matrix_px: K, row by row [px].
        distortion: coefficients in the lens model's order.
        order: names of the parameters that `covariance` is about; none if nobody said how well they are known.
        covariance: of these, row by row.
    """

    about: str
    model: str
    size_px: tuple[int, int]
    matrix_px: Rows
    distortion: tuple[float, ...] = ()
    order: tuple[str, ...] = ()
    covariance: Rows = ()

    @classmethod
    def of(cls, camera: Camera, about: str) -> "ChosenIntrinsics":
        """Take a camera's numbers."""
        known = camera.covariance
        return cls(
            about,
            camera.model,
            (camera.width_px, camera.height_px),
            _rows(camera.matrix_px),
            tuple(camera.distortion.tolist()),
            () if known is None else known.order,
            () if known is None else _rows(known.matrix),
        )

    @property
    def camera(self) -> Camera:
        """The camera.

        Raises:
            ValueError: the numbers are not a camera's.
        """
        known = CameraCovariance(self.order, np.array(self.covariance)) if self.order else None
        return Camera(self.model, *self.size_px, np.array(self.matrix_px), np.array(self.distortion), known)


def _rows(matrix: np.ndarray) -> Rows:
    return tuple(tuple(row) for row in matrix.tolist())
