"""Images of boards: the true corners are where an independent detector finds them at a finer scale, for every lens."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from benchmarks.boards import BoardFilm, render_board, true_corners
from calib_core.camera import Camera, CameraModel
from calib_core.errors import OptionError
from calib_core.geometry import RigidTransform, rotation_exp, rotation_log
from calib_core.intrinsics.board import Board
from calib_core.synthetic.boards import grid_rays, waved_poses
from calib_core.synthetic.rig import typical_camera

BOARD = Board("checkerboard", 7, 5, 0.03)
FINER = 4
POSE = RigidTransform(rotation_exp(np.array([0.35, -0.4, 0.12])), np.array([-0.09, -0.05, 0.42]))
MOVING = BoardFilm(rolling_shutter_s=0.02, velocity_mps=(0.5, -0.4, 0.3), turning_radps=(0.5, -0.7, 1.5))


def small(model: CameraModel = "plumb_bob") -> Camera:
    return typical_camera(model, width_px=320, height_px=240)


def found_finely(camera: Camera, film: BoardFilm, pose: RigidTransform = POSE) -> tuple[np.ndarray, np.ndarray]:
    """Return the true corners, and where OpenCV finds them in an image of the same size with finer pixels."""
    fine = camera.scaled(FINER)
    true = true_corners(BOARD, fine, pose, film)
    image = render_board(BOARD, fine, pose, replace(film, blur_px=1.5))
    window = (9, 9)
    start = true.astype(np.float32).reshape(-1, 1, 2) + np.float32(0.4)
    found = cv2.cornerSubPix(image[..., 0].copy(), start, window, (-1, -1), (3, 100, 1e-5))
    back = np.array([1.0, 1.0]) * (0.5 / FINER - 0.5)
    return true / FINER + back, found.reshape(-1, 2) / FINER + back


@pytest.mark.parametrize("model", ["pinhole", "plumb_bob", "rational_polynomial", "equidistant"])
def test_corners_are_where_a_detector_finds_them(model):
    true, found = found_finely(small(model), BoardFilm())
    error = found - true
    assert np.sqrt(np.square(error).mean()) < 0.006
    assert np.abs(error.mean(axis=0)).max() < 0.002
    assert true == pytest.approx(true_corners(BOARD, small(model), POSE), abs=1e-6)


@pytest.mark.parametrize(
    "film",
    [
        BoardFilm(bend_m=(0.006, -0.003)),
        MOVING,
    ],
    ids=["bent", "rolling shutter"],
)
def test_a_faulty_board_shows_its_faults(film):
    true, found = found_finely(small(), film)
    assert np.sqrt(np.square(found - true).mean()) < 0.006
    assert np.abs(true - true_corners(BOARD, small(), POSE)).max() > 0.5


def test_true_corners_agree_with_opencv():
    camera, fisheye = small(), small("equidistant")
    vector = rotation_log(POSE.rotation)
    pixels, _ = cv2.projectPoints(BOARD.corners_m, vector, POSE.translation_m, camera.matrix_px, camera.distortion)
    assert true_corners(BOARD, camera, POSE) == pytest.approx(pixels.reshape(-1, 2), abs=1e-9)
    round_pixels, _ = cv2.fisheye.projectPoints(
        BOARD.corners_m[None], vector, POSE.translation_m, fisheye.matrix_px, fisheye.distortion
    )
    assert true_corners(BOARD, fisheye, POSE) == pytest.approx(round_pixels.reshape(-1, 2), abs=1e-9)


def test_the_first_row_sees_the_board_earlier_than_the_last():
    camera = small()
    velocity = np.array(MOVING.velocity_mps)
    still = replace(MOVING, turning_radps=(0.0, 0.0, 0.0))
    moved = true_corners(BOARD, camera, POSE, still)
    earlier_s = MOVING.rolling_shutter_s * (0.5 * (camera.height_px - 1) - moved[:, 1]) / camera.height_px
    places = POSE @ BOARD.corners_m - earlier_s[:, None] * velocity
    assert moved == pytest.approx(camera.project(places), abs=1e-6)


def test_a_pixel_is_the_mean_of_its_finer_pixels():
    camera = small()
    fine = render_board(BOARD, camera.scaled(FINER), POSE, background=np.full((240 * FINER, 320 * FINER), 90.0))
    mean = cv2.resize(fine[..., 0].astype(np.float32), (320, 240), interpolation=cv2.INTER_AREA)
    coarse = render_board(BOARD, camera, POSE, background=np.full((240, 320), 90.0))[..., 0]
    difference = np.abs(coarse - mean)
    assert difference.mean() < 0.3
    assert difference.max() < 12.0


def test_rays_of_a_grid_are_those_of_the_camera():
    for model in ("plumb_bob", "rational_polynomial", "equidistant"):
        camera = typical_camera(model)
        u, v = np.linspace(-0.5, 1279.5, 17), np.linspace(-0.5, 719.5, 13)
        smooth = grid_rays(camera, u, v)
        exact = camera.rays(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)).T.reshape(smooth.shape)
        assert np.abs(smooth - exact).max() * camera.matrix_px[0, 0] < 1e-3, model


def test_a_moving_board_is_smeared_while_it_is_exposed():
    camera = small()
    sharp = render_board(BOARD, camera, POSE, background=np.full((240, 320), 90.0))
    smeared = render_board(
        BOARD,
        camera,
        POSE,
        BoardFilm(velocity_mps=(1.0, 0.0, 0.0), exposure_s=0.005),
        background=np.full((240, 320), 90.0),
    )
    along, across = (np.abs(np.diff(smeared[..., 0].astype(float), axis=axis)).max() for axis in (1, 0))
    assert along < 0.6 * np.abs(np.diff(sharp[..., 0].astype(float), axis=1)).max()
    assert across > along


def test_noise_and_light_are_as_asked_for():
    camera = small()
    grey = np.full((240, 320), 100.0)
    away = RigidTransform(np.eye(3), np.array([0.0, 0.0, -1.0]))
    noisy = render_board(BOARD, camera, away, BoardFilm(noise_grey=2.0), background=grey)
    assert noisy[..., 0].std() == pytest.approx(np.sqrt(4.0 + 1.0 / 12.0), rel=0.02)
    assert np.array_equal(noisy[..., 0], noisy[..., 2])
    lit = render_board(
        BOARD, camera, away, BoardFilm(exposure=0.8, gradient=(0.3, 0.0), vignetting=0.4), background=grey
    )
    assert lit[120, 160, 0] == pytest.approx(80, abs=1)
    assert lit[120, 319, 0] == pytest.approx(80 * 1.3 * (1.0 - 0.4 * 0.5), abs=1)
    assert lit[0, 0, 0] == pytest.approx(80 * 0.7 * 0.6, abs=1)


def test_the_same_seed_gives_the_same_image():
    film = BoardFilm(noise_grey=2.0)
    first = render_board(BOARD, small(), POSE, film, seed=3)
    assert np.array_equal(first, render_board(BOARD, small(), POSE, film, seed=3))
    assert not np.array_equal(first, render_board(BOARD, small(), POSE, film, seed=4))
    assert first.std() > 20.0


def test_opencv_reads_a_charuco_board():
    board = Board("charuco", 7, 5, 0.04, 0.03, "DICT_5X5_100")
    camera = typical_camera(width_px=640, height_px=480)
    pose = RigidTransform(rotation_exp(np.array([0.3, -0.2, 0.1])), np.array([-0.11, -0.07, 0.45]))
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    detector = cv2.aruco.CharucoDetector(cv2.aruco.CharucoBoard((7, 5), 0.04, 0.03, dictionary))
    pixels, ids, _, _ = detector.detectBoard(render_board(board, camera, pose, BoardFilm(blur_px=0.5)))
    assert sorted(ids.ravel()) == list(range(24))
    assert np.abs(pixels.reshape(-1, 2) - true_corners(board, camera, pose)[ids.ravel()]).max() < 0.5


def test_opencv_reads_the_tags_of_a_grid():
    board = Board("aprilgrid", 4, 3, 0.05, 0.015, "DICT_APRILTAG_36h11")
    camera = typical_camera(width_px=640, height_px=480)
    pose = RigidTransform(rotation_exp(np.array([0.2, -0.2, 0.0])), np.array([-0.12, -0.09, 0.4]))
    options = cv2.aruco.DetectorParameters()
    options.markerBorderBits = 2
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), options)
    outlines, ids, _ = detector.detectMarkers(render_board(board, camera, pose))
    assert sorted(ids.ravel()) == list(range(12))
    middles = {int(tag): outline.reshape(4, 2).mean(axis=0) for tag, outline in zip(ids.ravel(), outlines, strict=True)}
    assert middles[0][0] < middles[1][0]
    assert middles[0][1] > middles[4][1]  # tag 0 is below left
    first = outlines[list(ids.ravel()).index(0)].reshape(4, 2)
    assert first[0] == pytest.approx(first[first.sum(axis=1).argmax()])  # upside down to OpenCV


def test_a_waved_board_is_tilted_near_and_far_and_all_over_the_image():
    camera, board = typical_camera(), Board("checkerboard", 9, 6, 0.02214)
    poses = waved_poses(np.random.default_rng(1), board, camera, 30)
    pixels = np.concatenate([true_corners(board, camera, pose) for pose in poses])
    assert camera.in_image(pixels).all()
    counts, _, _ = np.histogram2d(*pixels.T, bins=(8, 5), range=((0, 1280), (0, 720)))
    assert (counts > 0).mean() > 0.9
    depths = [float(pose.translation_m[2]) for pose in poses]
    assert max(depths) > 1.6 * min(depths)
    assert np.ptp([pose.rotation[0, 2] for pose in poses]) > 0.8


@pytest.mark.slow
def test_a_board_that_does_not_fit_is_refused():
    flat = typical_camera(width_px=2000, height_px=64)
    with pytest.raises(OptionError, match="0 of 2 poses"):
        waved_poses(np.random.default_rng(1), BOARD, flat, 2)
