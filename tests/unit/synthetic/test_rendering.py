"""Rendered frames: the reflector's apex is at the true pixel, people are where the story puts them, nothing drifts."""

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest

from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.rendering.reflector import apex_edges
from calib_core.synthetic.rendering.still import Still, pixel_rays, trace_still
from calib_core.synthetic.rendering.surfaces import fractal_noise, line_coverage
from calib_core.synthetic.rig import Rig, random_rig, typical_camera
from calib_core.synthetic.scene.person import PersonState
from calib_core.synthetic.scene.scenes import scene_named
from calib_core.synthetic.scene.stage import Stage, set_stage
from calib_core.synthetic.scene.story import Moment, Resting

OPTIONS = SimulationOptions(placements=6, dwell_s=5.0, width_px=480, height_px=300, seed=3, radar_rate_hz=1.0)


@pytest.fixture(scope="module")
def stage() -> Stage:
    return set_stage(OPTIONS)


@pytest.fixture(scope="module")
def renderer(stage: Stage) -> FrameRenderer:
    return FrameRenderer.of(stage.scene, stage.rig)


def _border(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, float]:
    """Fit the straight line between two clouds of pixels: its unit normal and its distance from the origin."""
    near_one = one[np.linalg.norm(one[:, None] - other[None], axis=2).min(axis=1) < 6.0]
    near_other = other[np.linalg.norm(other[:, None] - one[None], axis=2).min(axis=1) < 6.0]
    points = np.concatenate([near_one, near_other])
    labels = np.concatenate([np.ones(len(near_one)), -np.ones(len(near_other))])
    middle = points.mean(axis=0)
    design = np.column_stack([points - middle, np.ones(len(points))])
    a, b, c = np.linalg.lstsq(design, labels, rcond=None)[0]
    length = np.hypot(a, b)
    normal = np.array([a, b]) / length
    return normal, float(normal @ middle - c / length)


def _apex_from_image(image: np.ndarray) -> np.ndarray:
    """Find where the three sheets meet from grey levels alone: sort pixels by brightness, intersect the borders.

    The image shows only the reflector on its orange block, in front of pure green.
    """
    levels = image.astype(float)
    grey = (levels.max(axis=2) - levels.min(axis=2)) < 16.0
    inside = (cv2.distanceTransform(grey.astype(np.uint8), cv2.DIST_L2, 5) > 3.0).astype(np.uint8)  # off the bright rim
    _, parts, sizes, _ = cv2.connectedComponentsWithStats(inside)
    sheets = parts == 1 + int(np.argmax(sizes[1:, cv2.CC_STAT_AREA]))  # not the block's white band
    linear = (levels.mean(axis=2) / 255.0) ** 2.2
    clouds = []
    for bottom, top in ((0.50, 0.90), (0.31, 0.46), (0.18, 0.27)):  # left, lower and right sheet
        sheet = (sheets & (linear > bottom) & (linear < top)).astype(np.uint8)
        v, u = np.nonzero(cv2.erode(sheet, np.ones((3, 3), dtype=np.uint8)))  # creases are smooth: mixed levels
        clouds.append(np.column_stack([u, v]).astype(float))
    left, low, right = clouds
    borders = [_border(a, b) for a, b in ((left, low), (low, right), (right, left))]
    normals = np.array([normal for normal, _ in borders])
    return np.linalg.lstsq(normals, np.array([offset for _, offset in borders]), rcond=None)[0]


def _before_green(rig: Rig) -> FrameRenderer:
    shape = (rig.camera.height_px, rig.camera.width_px)
    levels = np.zeros((*shape, 3), dtype=np.float32)
    levels[..., 1] = 255.0
    still = Still(
        levels, np.full(shape, np.inf), np.zeros(shape, dtype=bool), pixel_rays(rig), rig.camera_position_world_m
    )
    return FrameRenderer(scene_named("field"), rig, still)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["pinhole", "plumb_bob", "rational_polynomial", "equidistant"])
@pytest.mark.parametrize("place_m", [(2.0, 0.0), (2.1, 0.8), (2.6, -1.1)])
def test_the_sheets_in_the_image_meet_at_the_truth_pixel(model, place_m):
    rig = random_rig(np.random.default_rng(5), camera=typical_camera(model, width_px=1280, height_px=800))
    apex = np.array([*place_m, 0.19])
    facing_rad = float(np.arctan2(-place_m[1], -place_m[0]))
    person = PersonState(9.0, 0.0, 0.0)
    moment = Moment(person, apex, facing_rad, Resting(0, 0.0, 1.0, apex, facing_rad), 0.19)
    image = _before_green(rig).render(moment, person=False)
    truth = rig.camera.project(rig.camera_from_world @ apex[None])[0]
    assert np.linalg.norm(_apex_from_image(image) - truth) < 0.6


def test_the_three_edges_of_a_corner_are_at_right_angles_and_open_towards_the_radar():
    edges = apex_edges(facing_rad=2.0, elevation_rad=0.2)
    facing = np.array([np.cos(0.2) * np.cos(2.0), np.cos(0.2) * np.sin(2.0), np.sin(0.2)])
    assert edges @ edges.T == pytest.approx(np.eye(3), abs=1e-12)
    assert edges @ facing == pytest.approx(np.full(3, 1.0 / np.sqrt(3.0)))
    assert np.argmax(edges[:, 2]) == 0


@pytest.mark.parametrize("model", ["pinhole", "plumb_bob", "rational_polynomial", "equidistant"])
def test_pixels_look_where_the_lens_says(model):
    rig = random_rig(np.random.default_rng(4), camera=typical_camera(model, width_px=320, height_px=240))
    rays = pixel_rays(rig).reshape(-1, 3)
    u, v = np.meshgrid(np.arange(320.0), np.arange(240.0))
    pixels = np.column_stack([u.ravel(), v.ravel()])
    back = rig.camera.project(rays.astype(np.float64) @ rig.camera_from_world.rotation.T)
    assert np.abs(back - pixels).max() < 0.02


@pytest.mark.slow
def test_a_frame_is_the_same_every_time(renderer, stage):
    moment = stage.story.at(7.3)
    assert np.array_equal(renderer.render(moment), renderer.render(moment))


def test_a_person_is_drawn_where_the_story_has_them(renderer, stage):
    resting = stage.story.restings[2]
    moment = stage.story.at(0.5 * (resting.start_s + resting.end_s))
    with_person, without = (renderer.render(moment, person=shown).astype(int) for shown in (True, False))
    v, u = np.nonzero(np.abs(with_person - without).max(axis=2) > 40)
    chest = np.array([[moment.person.x_m, moment.person.y_m, 1.2]])
    middle = stage.rig.camera.project(stage.rig.camera_from_world @ chest)[0]
    assert len(u) > 100
    assert abs(np.median(u) - middle[0]) < 12.0
    assert v.min() < middle[1] < v.max()


def test_the_person_carries_the_reflector_between_placements(stage):
    for first, second in pairwise(stage.story.restings):
        moment = stage.story.at(0.5 * (first.end_s + second.start_s))
        hands = moment.reflector_m[:2] - moment.person.place_m
        assert moment.resting is None
        assert np.linalg.norm(hands) < 0.8


def test_at_rest_the_reflector_does_not_move_and_nobody_teleports(stage):
    resting = stage.story.restings[1]
    places = [stage.story.at(time_s).reflector_m for time_s in np.linspace(resting.start_s, resting.end_s - 1e-6, 9)]
    assert all(np.array_equal(place, resting.position_m) for place in places)
    times = np.arange(0.0, stage.story.duration_s, 0.02)
    walk = np.array([stage.story.at(float(time_s)).person.place_m for time_s in times])
    carried = np.array([stage.story.at(float(time_s)).reflector_m for time_s in times])
    assert np.linalg.norm(np.diff(walk, axis=0), axis=1).max() < 0.02 * 3.0
    assert np.linalg.norm(np.diff(carried, axis=0), axis=1).max() < 0.02 * 8.0


@pytest.mark.parametrize("scene", ["rooftop", "field", pytest.param("aisle", marks=pytest.mark.slow), "checkerboard"])
def test_every_scene_has_ground_below_and_light_above(scene):
    rig = random_rig(np.random.default_rng(2), camera=typical_camera(width_px=160, height_px=96))
    still = trace_still(scene_named(scene), rig)
    assert np.isfinite(still.levels).all()
    assert still.ground[-12:].mean() > 0.9
    assert not still.ground[:12].any()
    assert 40.0 < still.levels.mean() < 200.0
    assert still.levels.std() > 12.0


def test_what_stands_in_front_of_a_person_hides_them(renderer, stage):
    resting = stage.story.restings[2]
    moment = stage.story.at(0.5 * (resting.start_s + resting.end_s))
    before = renderer.render(moment)
    closed = replace(renderer, still=replace(renderer.still, depth_m=np.full_like(renderer.still.depth_m, 0.5)))
    hidden = np.abs(closed.render(moment).astype(int) - before.astype(int)).max(axis=2) > 40
    assert hidden.sum() > 100


@pytest.mark.slow
def test_sensor_noise_is_as_strong_as_requested_and_seeded():
    noisy = replace(OPTIONS, width_px=160, height_px=96, sensor_noise_grey=4.0)
    first, again = (next(simulate(noisy).frames(1)).pixels for _ in range(2))
    clean = next(simulate(replace(noisy, sensor_noise_grey=0.0)).frames(1)).pixels
    assert np.array_equal(first, again)
    assert (first.astype(float) - clean)[20:].std() == pytest.approx(4.0, rel=0.1)


def test_lines_cover_their_share_of_a_wide_pixel_and_all_of_a_narrow_one():
    wide = line_coverage(np.array([0.0, 0.31]), period_m=0.1, width_m=0.02, footprint_m=np.full(2, 10.0))
    narrow = line_coverage(np.array([0.0, 0.05]), period_m=0.1, width_m=0.02, footprint_m=np.full(2, 1e-3))
    assert wide == pytest.approx([0.2, 0.2], abs=0.01)
    assert narrow == pytest.approx([1.0, 0.0], abs=1e-6)


def test_noise_finer_than_a_pixel_is_left_out():
    u = np.linspace(0.0, 50.0, 4000).astype(np.float32)
    fine, coarse = (
        fractal_noise(u, u * 0.0, size_m=1.0, octaves=4, footprint_m=np.full(4000, size), seed=1)
        for size in (0.01, 5.0)
    )
    assert fine.std() > 0.2
    assert np.abs(coarse).max() == 0.0
