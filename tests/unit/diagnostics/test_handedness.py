"""Mirrored radar axes are told by the side of the ground on which the sensors stand, at any distance between them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, simulate_pairs
from calib_core.association.array_pairs import pairs_from_arrays
from calib_core.calibration import calibrate_pairs
from calib_core.geometry import RigidTransform
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, SolvingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.synthetic.rig import RigOptions

HANDEDNESS = {"mirrored-axes", "handedness-open", "handedness-assumed"}
ANYWHERE = CalibrationOptions(solving=SolvingOptions(sensors_above_placements=False))
TRIPOD = replace(FIELD, max_height_m=1.5)


def apart(distance_m: float) -> CalibrationOptions:
    return CalibrationOptions(solving=SolvingOptions(nominal_camera_distance_m=distance_m, rig_size_m=30.0))


def moved(pairs: Sequence[Pair], change: np.ndarray) -> list[Pair]:
    """Multiply the axes of every radar position."""
    return [
        replace(
            pair,
            candidates=tuple(replace(one, position_radar_m=one.position_radar_m * change) for one in pair.candidates),
        )
        for pair in pairs
    ]


def handedness(pairs: Sequence[Pair], simulated: SimulatedPairs, options: CalibrationOptions) -> set[str]:
    outcome = calibrate_pairs(pairs, simulated.camera, options).unwrap()
    return {one.code for one in outcome.warnings} & HANDEDNESS


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["ti", "imaging"])
@pytest.mark.parametrize(("offset_m", "distance_m"), [((0.0, 0.0, 0.045), 1.0), ((-3.0, 7.4, 1.0), 8.0)])
def test_the_side_of_the_ground_tells_mirrored_axes_from_right_ones(noise, offset_m, distance_m):
    for seed in range(3):
        rig = RigOptions(camera_offset_m=offset_m)
        simulated = simulate_pairs(20, rng=np.random.default_rng([81, seed]), noise=noise, rig_options=rig)
        assert handedness(simulated.pairs, simulated, apart(distance_m)) == set()
        for axes in ([1.0, -1.0, 1.0], [1.0, 1.0, -1.0]):
            mirrored = moved(simulated.pairs, np.array(axes))
            assert handedness(mirrored, simulated, apart(distance_m)) == {"mirrored-axes"}


def test_a_wrong_pair_off_the_plane_does_not_acquit_mirrored_axes():
    rng = np.random.default_rng([9301, 40, 0, ord("e"), 3])
    simulated = simulate_pairs(40, rng=rng, noise="imaging", outlier_share=0.1)
    assert handedness(simulated.pairs, simulated, apart(1.0)) == set()
    mirrored = moved(simulated.pairs, np.array([1.0, -1.0, 1.0]))
    assert handedness(mirrored, simulated, apart(1.0)) & {"mirrored-axes", "handedness-open"}


def test_without_the_assumption_flat_ground_is_never_called_good():
    for seed in range(3):
        simulated = simulate_pairs(20, rng=np.random.default_rng([82, seed]))
        assert handedness(simulated.pairs, simulated, ANYWHERE)
        tripod = simulate_pairs(20, rng=np.random.default_rng([83, seed]), layout=TRIPOD)
        assert handedness(tripod.pairs, tripod, ANYWHERE) == set()


def test_sensors_above_and_below_the_placements_are_accused_only_under_the_assumption():
    below = RigOptions(camera_offset_m=(0.0, 0.0, -2.4))  # a camera in a pit sees the reflector from below
    simulated = simulate_pairs(20, rng=np.random.default_rng(84), noise="imaging", rig_options=below)
    assert handedness(simulated.pairs, simulated, apart(2.4)) == {"mirrored-axes"}
    without = CalibrationOptions(solving=SolvingOptions(nominal_camera_distance_m=2.4, sensors_above_placements=False))
    assert handedness(simulated.pairs, simulated, without) != {"mirrored-axes"}


def test_a_radar_a_little_below_the_reflector_is_not_told_that_its_axes_are_mirrored():
    """One in a bumper, with the reflector on a stand: whether an axis is mirrored stays open."""
    rng, rotation = np.random.default_rng(86), np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    camera = simulate_pairs(20, rng=rng).camera
    pose = RigidTransform(rotation, -rotation @ np.array([-1.4, -0.2, 0.8]))
    polar = np.column_stack([rng.uniform(2.5, 9.0, 20), rng.uniform(-0.5, 0.5, 20), np.zeros(20)])
    points = cartesian_from_polar(polar) + np.array([0.0, 0.0, 0.2])
    measured = polar_from_cartesian(points) + rng.normal(0.0, 1.0, (20, 3)) * [0.02, np.deg2rad(0.2), np.deg2rad(0.3)]
    pixels = camera.project(pose @ points) + rng.normal(0.0, 2.0, (20, 2))
    pairs = pairs_from_arrays(cartesian_from_polar(measured), pixels)
    found = {one.code for one in calibrate_pairs(pairs, camera, apart(1.6)).unwrap().warnings}
    assert found & HANDEDNESS == {"handedness-open"}
    lower = pairs_from_arrays(cartesian_from_polar(measured) + np.array([0.0, 0.0, 0.6]), pixels)
    (told,) = (
        one for one in calibrate_pairs(lower, camera, apart(1.6)).unwrap().warnings if one.code == "mirrored-axes"
    )
    assert told.facts["radar_m"] == pytest.approx(-0.8, abs=0.1)
    assert told.facts["camera_m"] > 0.0


@pytest.mark.parametrize("kind", ["elevation", "height", "zero", "rounded"])
def test_a_radar_without_elevation_is_never_told_to_flip_an_axis(kind):
    for seed in range(3):
        rng = np.random.default_rng([85, seed])
        simulated = simulate_pairs(15, rng=rng)
        pairs = []
        for pair in simulated.pairs:
            polar = polar_from_cartesian(pair.candidates[0].position_radar_m)
            polar[2] = {"elevation": np.deg2rad(2.0), "rounded": 1e-6 * rng.standard_normal()}.get(kind, 0.0)
            position_m = cartesian_from_polar(polar) + np.array([0.0, 0.0, 0.5 if kind == "height" else 0.0])
            pairs.append(replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=position_m),)))
        assert handedness(pairs, simulated, CalibrationOptions()) == set()
