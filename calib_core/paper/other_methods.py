"""The paper's other methods, for its experiments: the mounting (PMM), and the exchange of translations.

PMM takes rotation and offset as designed or measured, and no data at all. An exchange combines the rotation of one
calibration with the translation of another, to see which of the two matters. Neither states an uncertainty; both are judged
on pairs that they were not fitted to. The checkerboard of a further method (CCM) is found in the frames of a recording: where
its inner corners are.
"""

from collections.abc import Iterator, Sequence
from dataclasses import astuple, replace
from typing import Protocol, runtime_checkable

import numpy as np

from calib_core.arrays import Flags, Points2, TimesNs
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.estimation.measurement_model import linearize
from calib_core.estimation.plausibility import implausible_input
from calib_core.geometry import RigidTransform, mounting_rotation
from calib_core.measurements import Pair, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.radar import polar_from_cartesian, sigma_polar_of
from calib_core.results import Calibration, DataWarning, PairResult
from calib_core.results.metrics import metrics_of

_EXPLAINED = 11.83  # chi2 of 2 degrees of freedom that noise exceeds in 0.27 % of the pairs


def calibrate_by_mounting(
    pairs: Sequence[Pair],
    camera: Camera,
    options: CalibrationOptions,
    *,
    excluded: frozenset[str] = frozenset(),
    unpaired: tuple[Unpaired, ...] = (),
) -> Calibration:
    """Return the pose of the mounting, judged on pairs that it does not depend on; there may be none.

    Args:
        pairs: in the order of the results.
        camera: the intrinsics.
        options: the mounting's angles, and the measured position of the camera.
        excluded: ids of pairs that are shown, but not judged on.
        unpaired: clicks without a radar position.

    Raises:
        InputError: the options state no measured position.
    """
    measured = options.solving.camera_position
    if measured is None:
        raise InputError(
            "the mounting (PMM) takes the camera's position from a tape measure, and none is given; measure from the radar's "
            "antennas to the lens: forward, left, up, in metres"
        )
    rotation = mounting_rotation(*astuple(options.mounting))
    pose = RigidTransform(rotation, -rotation @ np.array(measured.position_m))
    return judged(pose, pairs, unpaired, excluded, camera, options)


def swapped(rotation_of: Calibration, translation_of: Calibration) -> Calibration:
    """Combine two calibrations of one rig, and judge the result on the pairs of the first; no uncertainty is stated.

    The translation is that of camera_from_radar, in camera axes, as the paper swaps it.

    Args:
        rotation_of: gives rotation, pairs, camera and options.
        translation_of: gives the translation.

    Raises:
        InputError: the two were made with different intrinsics, so they cannot be of one camera.
    """
    first, second = rotation_of.camera, translation_of.camera
    kinds = [(camera.model, camera.width_px, camera.height_px, camera.distortion.shape) for camera in (first, second)]
    one_lens, other_lens = (np.append(camera.matrix_px, camera.distortion) for camera in (first, second))
    if kinds[0] != kinds[1] or not np.allclose(one_lens, other_lens):
        raise InputError(
            "rotation and translation can be combined only for one camera: the two calibrations have different intrinsics; "
            "solve both with the same camera file"
        )
    pose = RigidTransform(rotation_of.camera_from_radar.rotation, translation_of.camera_from_radar.translation_m)
    note = DataWarning(
        "swapped-parts",
        "this pose has the rotation of one calibration and the translation of another",
        "use it to see which part causes an error, not as a calibration",
    )
    return judged_again(rotation_of, pose, [note])


def judged(
    camera_from_radar: RigidTransform,
    pairs: Sequence[Pair],
    unpaired: tuple[Unpaired, ...],
    excluded: frozenset[str],
    camera: Camera,
    options: CalibrationOptions,
    warnings: Sequence[DataWarning] = (),
) -> Calibration:
    """Make a calibration without stated uncertainty of a pose and the pairs that it is judged on.

    Of each pair the most plausible radar position counts, never the one that suits the pose.

    Args:
        camera_from_radar: the pose.
        pairs: in the order of the results; there may be none.
        unpaired: clicks without a radar position.
        excluded: ids of pairs that are shown, but not judged on.
        camera: the intrinsics.
        options: the assumed noise.
        warnings: of the method.
    """
    results = tuple(
        PairResult(
            id=pair.id,
            pixel_px=pair.pixel_px,
            projected_px=np.full(2, np.nan),
            point_radar_m=pair.candidates[0].position_radar_m,
            inlier=False,
            excluded=pair.id in excluded,
            image_time=pair.image_time,
            measured=pair,
        )
        for pair in pairs
    )
    unjudged = Calibration(
        camera_from_radar, np.full((6, 6), np.nan), camera, metrics_of(np.zeros(0)), results, unpaired, (), options
    )
    return judged_again(unjudged, camera_from_radar, warnings)


def judged_again(
    calibration: Calibration, camera_from_radar: RigidTransform, warnings: Sequence[DataWarning] = ()
) -> Calibration:
    """Judge another pose on the radar positions of a calibration; the result states no uncertainty.

    Its inliers are the pairs whose residual the assumed noise explains.

    Args:
        calibration: whose pairs, camera, options and radar errors are kept.
        camera_from_radar: the pose.
        warnings: of the method.
    """
    bare = Calibration(
        camera_from_radar=camera_from_radar,
        covariance=np.full((6, 6), np.nan),
        camera=calibration.camera,
        metrics=metrics_of(np.zeros(0)),
        pairs=calibration.pairs,
        unpaired=calibration.unpaired,
        warnings=(),
        options=calibration.options,
        radar_errors=calibration.radar_errors,
    )
    if not calibration.pairs:
        return replace(bare, warnings=tuple(warnings))
    projected_px = bare.reproject(np.array([pair.point_radar_m for pair in calibration.pairs]))
    results = tuple(
        replace(_bare(pair), projected_px=at_px, inlier=bool(fits))
        for pair, at_px, fits in zip(calibration.pairs, projected_px, _explained(bare), strict=True)
    )
    lengths_px = np.sort([result.distance_px for result in results if not result.excluded])
    found = replace(bare, pairs=results, metrics=metrics_of(lengths_px[np.isfinite(lengths_px)]))
    return replace(found, warnings=(*_of_input(found), *_outside(found), *warnings))


def _bare(pair: PairResult) -> PairResult:
    """Return a pair without what another method computed for it."""
    unknown = float("nan")
    return replace(
        pair,
        outlier_probability=unknown,
        influence=unknown,
        expected_covariance_px2=np.full((2, 2), unknown),
        held_out_px=unknown,
    )


def _explained(calibration: Calibration) -> Flags:
    """Return whether the noise that the options assume explains each residual: (n,)."""
    noise, pairs = calibration.options.noise, calibration.pairs
    points = calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]))
    sigma_polar = sigma_polar_of(noise)
    clicks = [pair.measured.sigma_px if pair.measured is not None else None for pair in pairs]
    model = linearize(
        calibration.camera_from_radar,
        calibration.camera,
        pixels_px=np.array([pair.pixel_px for pair in pairs]),
        sigma_px=np.array([noise.sigma_px if sigma is None else sigma for sigma in clicks]),
        polar=polar_from_cartesian(points),
        sigma_polar=np.tile(sigma_polar, (len(pairs), 1)),
    )
    return np.asarray(model.squared <= _EXPLAINED)


def _of_input(calibration: Calibration) -> tuple[DataWarning, ...]:
    used = [pair for pair in calibration.pairs if not pair.excluded]
    if not used:
        return ()
    points, pixels = np.array([pair.point_radar_m for pair in used]), np.array([pair.pixel_px for pair in used])
    return implausible_input([pair.id for pair in used], points, pixels, calibration.camera, calibration.options)


def _outside(calibration: Calibration) -> list[DataWarning]:
    """Warn if the pose puts most of the radar positions beside the picture that they were clicked in."""
    used = [pair for pair in calibration.pairs if not pair.excluded]
    shown = sum(calibration.camera.in_image(pair.projected_px[None])[0] for pair in used)
    if not used or 2 * shown >= len(used):
        return []
    count = "all" if not shown else f"{len(used) - shown} of"
    return [
        DataWarning(
            "outside-picture",
            f"this pose puts {count} {len(used)} clicked radar positions outside the picture",
            "do not use this pose; use the default method",
        )
    ]


_MOST_FRAMES = 40
_STRIDE = 17
"""Coprime to the number of frames: frames far apart are searched first."""
_ENOUGH_VIEWS = 3
_STILL_PX = 3.0


@runtime_checkable
class PictureSource(Protocol):
    """The part of a Recording that shows the board."""

    image_times: TimesNs

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first."""


def find_board(source: object, columns: int, rows: int) -> Points2 | Unsolvable:
    """Find a checkerboard that stands still: its inner corners (rows * columns, 2) [px], row by row.

    Up to 40 frames all over the recording are searched, until three show the whole board.

    Args:
        source: a recording; one without pictures shows no board.
        columns: inner corners along the longer side of the board.
        rows: inner corners along its shorter side.

    Raises:
        CalibrationError: a frame cannot be read.
    """
    searched = 0
    views: list[Points2] = []
    for picture in _frames(source):
        searched += 1
        corners = find_corners(picture, columns, rows)
        if corners is not None:
            views.append(corners if not views else _in_the_order_of(views[0], corners))
        if len(views) == _ENOUGH_VIEWS:
            break
    if not views:
        return Unsolvable(
            "no-board",
            f"none of {searched} frames all over the recording shows a checkerboard of {columns} x {rows} inner "
            "corners as a whole",
            "record some seconds in which nothing hides the board, near enough that its squares are 10 px wide, and state its "
            "inner corners, which are one fewer than its squares",
        )
    moved_px = max(float(np.linalg.norm(view - views[0], axis=1).max()) for view in views)
    if moved_px > _STILL_PX:
        return Unsolvable(
            "board-moved",
            f"the checkerboard moves by {moved_px:.0f} px in the course of the recording",
            "leave board and sensors where they are while the reflector is put on its corners",
        )
    return np.asarray(np.mean(views, axis=0))


def find_corners(picture: np.ndarray, columns: int, rows: int) -> Points2 | None:
    """Find all inner corners of a checkerboard: (rows * columns, 2) [px], row by row; None if one of them is hidden.

    Args:
        picture: uint8 (h, w, 3), blue first.
        columns: inner corners in a row.
        rows: number of rows.
    """
    import cv2

    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    found, corners = cv2.findChessboardCornersSB(grey, (columns, rows), flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    return np.asarray(corners, dtype=np.float64).reshape(-1, 2) if found else None


def _frames(source: object) -> Iterator[np.ndarray]:
    if not isinstance(source, PictureSource) or not len(source.image_times):
        return
    places = np.linspace(0, len(source.image_times) - 1, _MOST_FRAMES).round().astype(int)
    order = places[_STRIDE * np.arange(_MOST_FRAMES) % _MOST_FRAMES]
    for index in dict.fromkeys(order.tolist()):
        yield source.image(index)


def _in_the_order_of(first_px: Points2, corners_px: Points2) -> Points2:
    """Count the corners from the same end of the board as in another view; a board looks the same from both."""
    turned = corners_px[::-1]
    apart, turned_apart = (np.linalg.norm(view - first_px, axis=1).sum() for view in (corners_px, turned))
    return turned if turned_apart < apart else corners_px
