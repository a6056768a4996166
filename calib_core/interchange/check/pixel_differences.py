"""The distance in the image between two calibrations, each through its own lens; the lens and the pose apart."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Matrix66, Points2, Points3, Values
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, skew
from calib_core.interchange.cameras.rectification import rectified_camera
from calib_core.interchange.format import ImportedCalibration

DISTANCES_M = (5.0, 20.0, 60.0)
LOST_TEXT = "behind the camera or far outside the image"
"""What is said instead of a distance in pixels that means nothing."""
_GRID = 7
_SAME_LENS_PX = 0.05
_FAR_OUTSIDE = 20.0


@dataclass(frozen=True, slots=True)
class PixelDifference:
    """How far apart two calibrations project points at one distance, each through its own lens.

    Attributes:
        distance_m: distance from the camera.
        rms_px: root mean square over the image of either; infinite if most points are behind the other camera.
        max_px: maximum over the image.
        sigma_px: root mean square of the pose's part that the two covariances predict; NaN if neither is known.
        pose_rms_px: the part of the pose: root mean square with one lens for both.
        lost_share: share of the image that the other one does not project into or near its image.
    """

    distance_m: float
    rms_px: float
    max_px: float
    sigma_px: float
    pose_rms_px: float
    lost_share: float = 0.0


@dataclass(frozen=True, slots=True)
class LensDifference:
    """How far apart two lenses project the same rays.

    Attributes:
        rms_px: root mean square over the image; NaN if the images have different sizes.
        max_px: maximum over the image.
        text: which numbers of the two cameras differ.
    """

    rms_px: float
    max_px: float
    text: str

    @property
    def same(self) -> bool:
        """Whether the two are one lens up to rounding."""
        return self.rms_px <= _SAME_LENS_PX


@dataclass(frozen=True, slots=True, eq=False)
class Lenses:
    """The lenses that the two sides of a comparison project through.

    Attributes:
        first: of the first side.
        second: of the second; that of the first if it has none, or one of another image size.
        difference: between the lenses that the sides state; None if one states none.
        note: what is compared, if that is not the two lenses as stated; else "".
    """

    first: Camera
    second: Camera
    difference: LensDifference | None = None
    note: str = ""


def lenses_of(a: ImportedCalibration, b: ImportedCalibration, camera: Camera | None) -> Lenses | None:
    """Return the lenses of two calibrations; one that states none is seen through the other's. None if nothing is known.

    A file that states only the matrix of undistorted images is compared in such images: with the same matrix, or with that
    of the rectified images of our exports.

    Args:
        a: the first.
        b: the second.
        camera: the intrinsics, if neither has any.
    """
    known = a.camera or b.camera or camera
    if known is None:
        return None
    size_px = (known.width_px, known.height_px)
    of_a, of_b = (_stated_camera(side, size_px) for side in (a, b))
    if of_a is None or of_b is None:
        one = of_a or of_b or known
        return Lenses(one, one)
    note = ""
    if (a.camera is None or b.camera is None) and (of_a.is_distorted or of_b.is_distorted):
        of_a, of_b = _undistorted(of_a, of_b), _undistorted(of_b, of_a)
        note = "one of the two states only the matrix of undistorted images, so the lens is compared without distortion"
    difference = _lens_difference(of_a, of_b)
    return Lenses(of_a, of_a if np.isnan(difference.rms_px) else of_b, difference, note)


def _stated_camera(side: ImportedCalibration, size_px: tuple[int, int]) -> Camera | None:
    try:
        return side.camera_for(size_px)
    except ValueError:  # not a camera matrix; reading or importing it says so
        return None


def _undistorted(camera: Camera, other: Camera) -> Camera:
    """Return the camera of undistorted images: with its own matrix, or our exports', whichever is nearer to the other's."""
    same = Camera("pinhole", camera.width_px, camera.height_px, camera.matrix_px)
    try:
        ours = rectified_camera(camera) if camera.is_distorted else same
    except InputError:  # no image can be cut from this lens
        return same
    return min(same, ours, key=lambda one: float(np.abs(one.matrix_px - other.matrix_px).max()))


def _lens_difference(first: Camera, second: Camera) -> LensDifference:
    sizes = [(camera.width_px, camera.height_px) for camera in (first, second)]
    if sizes[0] != sizes[1]:
        (a, b), (c, d) = sizes
        return LensDifference(float("nan"), float("nan"), f"images of {a} x {b} px and of {c} x {d} px")
    pixels, rays = _grid(first)
    apart, lost = _distances_px(second, rays, pixels)
    rms_px, max_px = _rms_and_max(apart, lost)
    return LensDifference(rms_px, max_px, "; ".join(_different_numbers(first, second)))


def _different_numbers(first: Camera, second: Camera) -> list[str]:
    rows = [f"{first.model} and {second.model}"] if first.model != second.model else []
    for name, row, column in (("fx", 0, 0), ("fy", 1, 1), ("cx", 0, 2), ("cy", 1, 2)):
        one, other = first.matrix_px[row, column], second.matrix_px[row, column]
        if abs(one - other) > _SAME_LENS_PX:
            rows.append(f"{name} {one:.6g} and {other:.6g}")
    if (
        first.distortion.shape != second.distortion.shape
        or np.abs(first.distortion - second.distortion).max(initial=0.0) > 1e-6
    ):
        rows.append("distortion")
    return rows


def pixel_difference(
    a_pose: RigidTransform, b_pose: RigidTransform, lenses: Lenses, distance_m: float, covariance: Matrix66
) -> PixelDifference:
    """Compare the projections of points at one distance along the rays of a pixel grid, in either direction.

    Args:
        a_pose: camera_from_radar of the first.
        b_pose: of the second.
        lenses: what each projects through.
        distance_m: of the points from the camera whose rays they are on.
        covariance: (6, 6) of the difference of the poses; NaN where unknown.
    """
    b_from_a = b_pose @ a_pose.inverse()
    both = [
        _one_way(moved, lens, other, distance_m, covariance)
        for moved, lens, other in (
            (b_from_a, lenses.first, lenses.second),
            (b_from_a.inverse(), lenses.second, lenses.first),
        )
    ]
    rms_px, sigma_px, pose_rms_px = (
        float(np.sqrt(np.mean([getattr(one, name) ** 2 for one in both])))
        for name in ("rms_px", "sigma_px", "pose_rms_px")
    )
    return PixelDifference(
        distance_m,
        rms_px,
        max(one.max_px for one in both),
        sigma_px,
        pose_rms_px,
        float(np.mean([one.lost_share for one in both])),
    )


def _one_way(
    moved: RigidTransform, lens: Camera, other: Camera, distance_m: float, covariance: Matrix66
) -> PixelDifference:
    """Compare along the rays of one of the two lenses; `moved` leads from its camera to the other's."""
    pixels, rays = _grid(lens)
    points_camera_m = rays * distance_m
    moved_camera_m = moved @ points_camera_m
    apart, lost = _distances_px(other, moved_camera_m, pixels)
    by_pose = _rms_and_max(*_distances_px(lens, moved_camera_m, pixels))[0]
    motion = np.stack([np.hstack([np.eye(3), -skew(point)]) for point in points_camera_m])
    by_error = lens.project_with_jacobian(points_camera_m)[1] @ motion
    variances = np.einsum("nij,jk,nik->n", by_error, covariance, by_error)
    return PixelDifference(
        distance_m, *_rms_and_max(apart, lost), float(np.sqrt(np.mean(variances))), by_pose, float(lost.mean())
    )


def _grid(camera: Camera) -> tuple[Points2, Points3]:
    """Return the pixels (n, 2) of a grid over the image and their rays (n, 3), where the lens has one."""
    columns, rows = np.linspace(0, camera.width_px - 1, _GRID), np.linspace(0, camera.height_px - 1, _GRID)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    rays = camera.rays(grid)
    seen = np.isfinite(rays).all(axis=1)
    return camera.project(rays[seen]), rays[seen]


def _distances_px(camera: Camera, points_camera_m: Points3, pixels: Points2) -> tuple[Values, Flags]:
    """Return how far (n,) points project from given pixels, and which of them (n,) the camera does not see at all."""
    apart = np.linalg.norm(camera.project(points_camera_m) - pixels, axis=1)
    return apart, far_outside(apart, camera)


def far_outside(apart_px: Values, camera: Camera) -> Flags:
    """Return which distances (n,) from a pixel in the image are of points behind the camera, or nearly beside it."""
    with np.errstate(invalid="ignore"):
        return np.asarray(~(apart_px <= _FAR_OUTSIDE * np.hypot(camera.width_px, camera.height_px)))


def _rms_and_max(apart: Values, lost: np.ndarray) -> tuple[float, float]:
    if not len(apart) or lost.mean() > 0.5:
        return float("inf"), float("inf")
    return float(np.sqrt(np.mean(apart[~lost] ** 2))), float(apart[~lost].max())


def pixels_text(at: PixelDifference) -> str:
    """Return a difference at one distance in words."""
    if np.isinf(at.rms_px):
        return LOST_TEXT
    lost = f", {at.lost_share:.0%} of the image {LOST_TEXT}" if at.lost_share else ""
    return f"{shown(at.rms_px)} px rms, {shown(at.max_px)} px max{lost}"


def shown(value: float) -> str:
    """Format a number with three significant digits; anything up to a millionth is rounding and shown as 0."""
    return f"{value if abs(value) > 1e-6 else 0:.3g}"
