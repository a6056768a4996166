"""The reflector of square sheets: its sheets meet at the apex, which is where the truth says, and its echo is the same."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.synthetic import SimulationOptions, simulate
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.rendering.reflector import pole_limbs, square_edges
from calib_core.synthetic.rendering.still import Still, pixel_rays
from calib_core.synthetic.rendering.surfaces import sun_direction
from calib_core.synthetic.scene.stage import Stage, set_stage

OPTIONS = SimulationOptions(
    placements=3, dwell_s=4.0, seed=3, radar_rate_hz=2.0, person=False, reflector_design="square"
)


@pytest.fixture(scope="module")
def stage() -> Stage:
    return set_stage(OPTIONS)


@pytest.fixture(scope="module")
def renderer(stage: Stage) -> FrameRenderer:
    shape = (OPTIONS.height_px, OPTIONS.width_px)
    green = np.broadcast_to(np.array([0.0, 200.0, 0.0], dtype=np.float32), (*shape, 3)).copy()
    eye_m = stage.rig.camera_position_world_m
    still = Still(green, np.full(shape, np.inf), np.zeros(shape, dtype=np.bool_), pixel_rays(stage.rig), eye_m)
    return FrameRenderer(stage.scene, stage.rig, still, sun_direction(stage.scene), design="square")


def test_the_edges_are_at_right_angles_and_one_points_down():
    edges = square_edges(2.0, 0.2)
    assert edges @ edges.T == pytest.approx(0.04 * np.eye(3), abs=1e-12)
    assert np.argmin(edges[:, 2]) == 0
    assert (edges[1:, 2] > 0.0).all()


def test_three_sheets_of_different_grey_meet_at_the_true_pixel(renderer, stage):
    nearest = min(stage.story.restings, key=lambda one: float(np.linalg.norm(one.position_m)))
    picture = renderer.render(stage.story.at(0.5 * (nearest.start_s + nearest.end_s)), person=False).astype(float)
    apex_px = stage.rig.camera.project(stage.rig.camera_from_world @ nearest.position_m[None])[0]
    greys = []
    for turn_deg in (-90.0, 30.0, 150.0):  # above, and below to the right and to the left
        column, row = np.round(apex_px + 6.0 * np.array([np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))]))
        pixel = picture[int(row), int(column)]
        assert np.ptp(pixel) < 20.0  # grey, not the green behind
        greys.append(float(pixel.mean()))
    assert np.diff(sorted(greys)).min() > 8.0


def test_the_pole_stands_on_the_ground_and_is_short_while_it_is_carried():
    apex_m = np.array([4.0, 1.0, 1.2])
    pole, foot = pole_limbs(apex_m, 3.0, 0.16, at_rest=True)
    assert pole.end_m[2] == foot.start_m[2] == 0.0
    (carried,) = pole_limbs(apex_m, 3.0, 0.16, at_rest=False)
    assert carried.end_m[2] > 0.5


def test_the_design_changes_no_echo():
    square, usual = (simulate(replace(OPTIONS, reflector_design=design)) for design in ("square", "triangular"))
    for one, other in zip(square.scans(), usual.scans(), strict=True):
        np.testing.assert_array_equal(one.points_radar_m, other.points_radar_m)
