"""Intrinsics that a person has chosen for a session: plain numbers, so that two sessions can be compared."""

from typing import Annotated, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta

from calib_core.camera import Camera, CameraCovariance

_Row: TypeAlias = Annotated[tuple[float, ...], Meta(max_length=40)]
_Row3: TypeAlias = tuple[float, float, float]
_Name: TypeAlias = Annotated[str, Meta(max_length=100)]
_Pixels: TypeAlias = Annotated[int, Meta(ge=1, le=1_000_000)]


class ChosenIntrinsics(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
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

    about: Annotated[str, Meta(max_length=500)]
    model: _Name
    size_px: tuple[_Pixels, _Pixels]
    matrix_px: tuple[_Row3, _Row3, _Row3]
    distortion: _Row = ()
    order: Annotated[tuple[_Name, ...], Meta(max_length=40)] = ()
    covariance: Annotated[tuple[_Row, ...], Meta(max_length=40)] = ()

    @classmethod
    def of(cls, camera: Camera, about: str) -> "ChosenIntrinsics":
        """Take a camera's numbers."""
        known = camera.covariance
        first, second, third = ((row[0], row[1], row[2]) for row in camera.matrix_px.tolist())
        return cls(
            about,
            camera.model,
            (camera.width_px, camera.height_px),
            (first, second, third),
            tuple(camera.distortion.tolist()),
            () if known is None else known.order,
            () if known is None else tuple(map(tuple, known.matrix.tolist())),
        )

    @property
    def camera(self) -> Camera:
        """The camera.

        Raises:
            ValueError: the numbers are not a camera's.
        """
        known = CameraCovariance(self.order, np.array(self.covariance)) if self.order else None
        return Camera(self.model, *self.size_px, np.array(self.matrix_px), np.array(self.distortion), known)
