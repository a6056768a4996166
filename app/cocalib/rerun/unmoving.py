"""What holds for the whole recording: entity paths, transforms, the frustum, reflectors, all clicks, uncertainty, the summary."""

from collections.abc import Iterator, Sequence

import numpy as np
import rerun as rr

from calib_core.arrays import Points2
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, camera_position_jacobian
from calib_core.radar import covariance_from_sigma_polar
from calib_core.results import Calibration, PairResult
from calib_core.results.calibration import CHI2_95_2, CHI2_95_3, CHI2_95_6
from calib_core.words.warnings import warning_remark
from cocalib.colours import residual_colours
from cocalib.recorded_view import RecordedView

TIMELINE = "recorded"
"""The stamps of the recording, as the solver uses them."""
RADAR = "radar"
"""The root: the radar's frame, x forward, y left, z up."""
RETURNS = f"{RADAR}/returns"
_REFLECTORS = f"{RADAR}/reflectors"
CAMERA = f"{RADAR}/camera"
_CAMERA_POSITION = f"{RADAR}/camera_position_95"
_AGAINST_CAMERA = f"{RADAR}/against"
IMAGE = f"{CAMERA}/image"
SEEN_RETURNS = f"{IMAGE}/returns"
AGAINST_RETURNS = f"{IMAGE}/returns_against"
BOXES = f"{IMAGE}/boxes"
PAIRS = f"{IMAGE}/all_clicks"
CLICKED_NOW = f"{IMAGE}/clicked_now"
METRICS = "metrics"
RESIDUALS = f"{METRICS}/residual_px"
AED = f"{METRICS}/aed_px"
ACC = f"{METRICS}/acc_percent"
RETURNS_SEEN = f"{METRICS}/returns_in_image"
SUMMARY = "summary"
HALF_PIXEL_PX = 0.5
"""Rerun's (0, 0) is the corner of the top-left pixel, ours its center."""
LARGE_PX = 30.0
"""Residuals from here on have the last color, as on the page."""
_AGAINST = (230, 120, 230)
_CAMERA = (87, 182, 242)
_FRUSTUM_SHARE = 0.06
_CIRCLE = np.stack([np.cos(np.linspace(0, 2 * np.pi, 49)), np.sin(np.linspace(0, 2 * np.pi, 49))])


def log_unmoving(stream: rr.RecordingStream, view: RecordedView) -> None:
    """Write everything that has no time."""
    far_m = view.colours.high if view.colours.quantity == "range" else 30.0
    stream.log(RADAR, rr.ViewCoordinates.FLU, static=True)
    stream.log(RADAR, rr.TransformAxes3D(1.0), static=True)
    stream.log(RETURNS, rr.Points3D.from_fields(radii=rr.Radius.ui_points(2.5)), static=True)
    stream.log(SEEN_RETURNS, rr.Points2D.from_fields(radii=rr.Radius.ui_points(4.0), draw_order=30.0), static=True)
    _log_camera(stream, CAMERA, IMAGE, view.calibration, _FRUSTUM_SHARE * far_m, _CAMERA)
    if view.against is not None:
        stream.log(AGAINST_RETURNS, rr.Points2D.from_fields(radii=rr.Radius.ui_points(3.0)), static=True)
        _log_camera(
            stream, _AGAINST_CAMERA, f"{_AGAINST_CAMERA}/frustum", view.against, _FRUSTUM_SHARE * far_m, _AGAINST
        )
    _log_camera_position(stream, view.calibration)
    if view.pairs:
        _log_pairs(stream, view)
    stream.log(SUMMARY, rr.TextDocument(summary_text(view), media_type=rr.MediaType.TEXT), static=True)


def _log_camera(
    stream: rr.RecordingStream,
    entity: str,
    image: str,
    calibration: Calibration,
    depth_m: float,
    colour: tuple[int, int, int],
) -> None:
    """Write the camera's pose in the radar's frame, and its frustum: of the camera matrix, as Rerun knows no distortion."""
    radar_from_camera = calibration.camera_from_radar.inverse()
    pose = rr.Transform3D(translation=radar_from_camera.translation_m, mat3x3=radar_from_camera.rotation)
    stream.log(entity, pose, static=True)
    stream.log(image, _pinhole(calibration.camera, depth_m, colour), static=True)


def _pinhole(camera: Camera, depth_m: float, colour: tuple[int, int, int]) -> rr.Pinhole:
    matrix = camera.matrix_px.copy()
    matrix[:2, 2] += HALF_PIXEL_PX
    return rr.Pinhole(
        image_from_camera=matrix,
        resolution=[camera.width_px, camera.height_px],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=depth_m,
        color=colour,
    )


def _log_camera_position(stream: rr.RecordingStream, calibration: Calibration) -> None:
    """Write the ellipsoid that contains the camera's lens with 95 % probability, if the method states an uncertainty."""
    covariance = calibration.covariance
    if not np.isfinite(covariance).all():
        return
    pose: RigidTransform = calibration.camera_from_radar
    moves = camera_position_jacobian(pose)
    heavier = max(1.0, float(np.nan_to_num(calibration.covariance_quantile)) / CHI2_95_6)
    position_m2 = (moves @ covariance @ moves.T)[None] * heavier
    centre = pose.inverse().translation_m[None]
    stream.log(
        _CAMERA_POSITION,
        _ellipsoids(centre, position_m2, np.array([_CAMERA], dtype=np.uint8), ["camera, 95 %"]),
        static=True,
    )


def _log_pairs(stream: rr.RecordingStream, view: RecordedView) -> None:
    """Write all clicks over the image, and the reflectors with their 95 % ellipsoids in the radar's frame."""
    pairs = [pair for pair in view.pairs if np.isfinite(pair.projected_px).all()]
    colours = residual_colours(np.array([pair.distance_px for pair in pairs]), LARGE_PX)
    lines = [np.array([pair.pixel_px, pair.projected_px]) + HALF_PIXEL_PX for pair in pairs]
    clicked = np.array([pair.pixel_px for pair in pairs]).reshape(-1, 2) + HALF_PIXEL_PX
    ids = [pair.id for pair in pairs]
    stream.log(
        f"{PAIRS}/residuals", rr.LineStrips2D(lines, colors=colours, radii=rr.Radius.ui_points(1.0)), static=True
    )
    dots = rr.Points2D(clicked, colors=colours, radii=rr.Radius.ui_points(2.0), labels=ids, show_labels=False)
    stream.log(f"{PAIRS}/clicks", dots, static=True)
    stream.log(
        f"{PAIRS}/ellipses_95",
        rr.LineStrips2D(ellipse_strips(pairs), colors=(154, 166, 178, 110), radii=rr.Radius.ui_points(0.5)),
        static=True,
    )
    points = np.array([pair.point_radar_m for pair in pairs]).reshape(-1, 3)
    noise, scale = view.calibration.options.noise, view.calibration.noise_scale
    sigma = np.array(
        [noise.sigma_range_m, np.deg2rad(noise.sigma_azimuth_deg), np.deg2rad(noise.sigma_elevation_deg)]
    ) * np.array(scale[1:])
    covariances = covariance_from_sigma_polar(points, np.broadcast_to(sigma, points.shape))
    stream.log(f"{_REFLECTORS}/ellipsoids_95", _ellipsoids(points, covariances, colours, ids), static=True)
    stream.log(_REFLECTORS, rr.Points3D(points, colors=colours, radii=rr.Radius.ui_points(4.0)), static=True)


def ellipse_strips(pairs: Sequence[PairResult]) -> list[Points2]:
    """Return the outline around each reprojection that contains 95 % of the clicks of good pairs, where it is known."""
    strips = []
    for pair in pairs:
        covariance = pair.expected_covariance_px2
        if np.isfinite(covariance).all() and np.isfinite(pair.projected_px).all():
            squares, axes = np.linalg.eigh((covariance + covariance.T) / 2.0)
            half_axes = axes * np.sqrt(np.maximum(squares, 0.0) * CHI2_95_2)
            strips.append(pair.projected_px + (half_axes @ _CIRCLE).T + HALF_PIXEL_PX)
    return strips


def _ellipsoids(
    centres_m: np.ndarray, covariances_m2: np.ndarray, colours: np.ndarray, labels: Sequence[str]
) -> rr.Ellipsoids3D:
    squares, axes = np.linalg.eigh(covariances_m2)
    axes[:, :, 0] *= np.sign(np.linalg.det(axes))[:, None]
    from scipy.spatial.transform import Rotation

    return rr.Ellipsoids3D(
        centers=centres_m,
        half_sizes=np.sqrt(np.maximum(squares, 0.0) * CHI2_95_3),
        quaternions=Rotation.from_matrix(axes).as_quat(),
        colors=colours,
        line_radii=rr.Radius.ui_points(0.6),
        labels=list(labels),
        show_labels=False,
    )


def summary_text(view: RecordedView) -> str:
    """Return the summary as plain text: as Markdown, a name in a recording could make the viewer fetch an image."""
    return "\n".join(_lines(view)) + "\n"


def _lines(view: RecordedView) -> Iterator[str]:
    recording = view.recording
    yield f"recording: {recording.name}"
    yield f"radar: {recording.radar_topic}, camera: {recording.image_topic}"
    yield ""
    yield str(view.calibration)
    yield ""
    yield from _figures(view)
    what = "range" if view.colours.quantity == "range" else "radial speed"
    low, high = view.colours.ends
    yield f"returns: colored by {what}, {low} to {high}"
    if view.against is not None:
        yield "pink: the other calibration"
    if view.pairs:
        yield "clicks: blue for residuals near 0 px, red from 30 px; outlines contain 95 % of the clicks of good pairs"
    if view.calibration.camera.is_distorted:
        yield (
            "lens: returns are projected through the calibration's own lens; the frustum in 3D is of the camera matrix alone, "
            "because Rerun has no lens distortion"
        )
    for warning in view.calibration.warnings:
        yield f"warning {warning.code}: {warning_remark(warning).message}"


def _figures(view: RecordedView) -> Iterator[str]:
    evaluation = view.evaluation
    if evaluation is None:
        return
    if evaluation.residuals is not None:
        figures = evaluation.residuals
        metrics = figures.metrics
        yield (
            f"on this recording: AED {metrics.aed_px:.2f} px, CDSD {metrics.cdsd_px:.2f} px, median {figures.median_px:.2f} px, "
            f"{metrics.n} clicks"
        )
    boxes = evaluation.boxes
    if boxes is not None and boxes.acc is not None:
        frames = sum(frame.returns > 0 for frame in boxes.frames)
        yield f"Acc {100 * boxes.acc:.1f} % over {frames} frames ({boxes.source}); it is nearly blind to roll"
