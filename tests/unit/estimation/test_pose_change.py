"""Two sessions of the same sensors are fitted together: a change is found, and what they share is not taken for one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import NoiseName, SystematicErrors, draw_systematic_errors, simulate_pairs, study_camera
from calib_core.calibration import preview_pairs
from calib_core.estimation.pose_change import AXES, PoseChange, pose_change
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.synthetic.rig import Rig, random_rig

PAIRS = 24


def sessions(
    seed: int,
    *,
    noise: NoiseName = "imaging",
    errors: SystematicErrors | None = None,
    yaw_deg: float = 0.0,
    up_m: float = 0.0,
    tapes_off_m: Sequence[float] = (),
) -> tuple[Calibration, Calibration]:
    """Return two calibrations of one rig, whose camera is turned and moved between them; each is clicked by another person."""
    rng = np.random.default_rng([seed, 77])
    rig = random_rig(rng, camera=study_camera())
    shared = errors or draw_systematic_errors(rng)
    found = []
    for which in range(2):
        person = draw_systematic_errors(rng)
        own = replace(shared, click_offset_px=person.click_offset_px, reflector_offset_m=person.reflector_offset_m)
        seen = turned(rig, yaw_deg, up_m) if which else rig
        options = CalibrationOptions()
        if tapes_off_m:
            x_m, y_m, z_m = (rig.camera_position_radar_m + tapes_off_m[which]).tolist()
            options = CalibrationOptions(solving=SolvingOptions(CameraPositionPrior((x_m, y_m, z_m), 0.01)))
        pairs = simulate_pairs(PAIRS, rng=rng, noise=noise, rig=seen, systematic=errors or own)
        found.append(preview_pairs(pairs.pairs, pairs.camera, options).unwrap())
    return found[0], found[1]


def turned(rig: Rig, yaw_deg: float, up_m: float) -> Rig:
    rotation = rig.camera_from_radar.rotation @ rotation_exp(np.array([0.0, 0.0, np.deg2rad(yaw_deg)]))
    return replace(
        rig,
        camera_from_radar=RigidTransform(rotation, -rotation @ (rig.camera_position_radar_m + np.array([0, 0, up_m]))),
    )


def change_of(*both: Calibration, same_person: bool = False) -> PoseChange:
    found = pose_change(*both, same_lens=True, same_person=same_person)
    assert isinstance(found, PoseChange)
    return found


def test_a_turn_of_one_degree_is_found_where_added_covariances_hide_it():
    before, after = sessions(3, yaw_deg=1.0)
    change = change_of(before, after)
    added = PoseChange(
        before.camera_from_radar,
        after.camera_from_radar.error_from(before.camera_from_radar),
        before.covariance + after.covariance,
        1e6,
    )

    assert change.p_value < 1e-5
    assert added.p_value > 0.01
    turn_deg = np.rad2deg(before.camera_from_radar.rotation.T @ change.error[3:])
    assert turn_deg[2] == pytest.approx(1.0, abs=0.3)


def test_a_large_error_of_radar_and_lens_is_no_change():
    errors = SystematicErrors(
        azimuth_scale=0.04, range_bias_m=0.06, principal_point_px=(10.0, -8.0), focal_length=0.006
    )

    assert change_of(*sessions(2, errors=errors), same_person=True).p_value > 0.05


def test_which_of_the_two_is_the_first_changes_nothing():
    before, after = sessions(3)
    one, other = change_of(before, after), change_of(after, before)

    assert one.squared == pytest.approx(other.squared, rel=1e-3)
    np.testing.assert_allclose(one.noticeable(0.05), other.noticeable(0.05), rtol=0.02)


@pytest.mark.slow
def test_the_distance_of_unchanged_sessions_is_that_of_six_degrees_of_freedom():
    squared = [change_of(*sessions(seed, noise="ti")).squared for seed in range(10, 22)]

    assert 3.0 < np.mean(squared) < 9.0  # 6, to three standard errors


def test_the_noticeable_size_is_noticed_in_95_of_100():
    from scipy.stats import ncx2

    rotation = rotation_exp(np.array([0.3, -1.2, 0.4]))
    change = PoseChange(RigidTransform(rotation, np.zeros(3)), np.zeros(6), np.diag([4e-4] * 3 + [1e-4] * 3), 1e6)

    sizes = change.noticeable(0.01)

    assert dict(zip(AXES, sizes, strict=True)).keys() == {"roll", "pitch", "yaw", "forward", "left", "up"}
    np.testing.assert_allclose(sizes[:3], np.degrees(sizes[0] * np.pi / 180), rtol=1e-9)
    for sigmas in (np.deg2rad(sizes[0]) / 0.01, sizes[5] / 100 / 0.02):
        assert ncx2.sf(change.limit(0.01), 6, sigmas**2) == pytest.approx(0.95, abs=1e-4)


def test_a_camera_position_stated_twice_was_measured_once_and_says_nothing_of_a_move():
    once = change_of(*sessions(4, tapes_off_m=(0.0, 0.0)))
    twice = change_of(*sessions(4, tapes_off_m=(0.0, 0.001)))
    free = change_of(*sessions(4))

    assert twice.noticeable(0.05)[5] < 0.9 * once.noticeable(0.05)[5]
    assert once.noticeable(0.05)[5] == pytest.approx(free.noticeable(0.05)[5], rel=0.2)


def test_sets_that_cannot_be_fitted_together_say_why():
    before, after = sessions(5)
    edited = replace(after, camera_from_radar=after.camera_from_radar.perturbed(np.array([0, 0, 0, 0, 0.1, 0])))

    for other, reason in (
        (replace(after, pairs=()), "keeps no pairs"),
        (edited, "pose of its own pairs"),
        (before, "pairs in common"),
    ):
        assert reason in str(pose_change(before, other, same_lens=True, same_person=False))
