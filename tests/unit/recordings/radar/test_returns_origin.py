"""Whose frame returns are in, by their frame's name and by what they themselves show, of radars mounted in three ways."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.recordings.radar.returns_origin import (
    Origin,
    ReturnsOrigin,
    mount_numbers,
    mount_of,
    named_origin,
    origin_of,
)
from calib_core.recordings.selection import Mount
from calib_core.synthetic.options import RadarName, SimulationOptions
from calib_core.synthetic.recording import simulate

FRONT: Mount = (3.7, 0.0, 0.6, 0.0, 0.0, 0.0)
CORNER: Mount = (3.4, 0.8, 0.5, 0.0, 0.0, 45.0)
ROOF: Mount = (1.2, -0.3, 1.7, 1.0, 3.0, -8.0)
MOUNTS = [FRONT, CORNER, ROOF]


@cache
def scans_of(radar: RadarName) -> RadarScans:
    scans = simulate(SimulationOptions(radar=radar, scene="field", seed=1, radar_rate_hz=5.0)).scans
    return RadarScans.from_scans([scans.scan(i) for i in range(0, len(scans), len(scans) // 40)])


def moved(scans: RadarScans, mount: RigidTransform) -> RadarScans:
    """Return what a driver publishes that has moved them into the body's frame, in 32 bits."""
    return replace(scans, points_radar_m=(mount @ scans.points_radar_m).astype(np.float32).astype(np.float64))


def decided(origin: ReturnsOrigin) -> tuple[Origin, bool, tuple[str, ...]]:
    return origin.by_data, origin.moved_by is not None, tuple(warning.code for warning in origin.warnings)


OPEN = ("radar-in-vehicle-frame",)


@pytest.mark.slow
@pytest.mark.parametrize("numbers", MOUNTS)
@pytest.mark.parametrize("radar", ["awr1843", "imaging"])
def test_returns_are_taken_back_where_name_and_data_agree_and_nothing_is_silent(radar, numbers):
    scans, mount = scans_of(radar), mount_of(numbers)
    in_body = moved(scans, mount)
    assert decided(origin_of(in_body, "base_link", mount)) == ("body", True, ())
    assert decided(origin_of(scans, "base_link", mount)) == ("sensor", False, OPEN)
    assert decided(origin_of(in_body, "radar_front", mount)) == ("body", False, OPEN)
    assert decided(origin_of(in_body, "", mount)) == ("body", False, OPEN)
    assert decided(origin_of(scans, "radar_front", mount)) == ("sensor", False, ())
    assert decided(origin_of(scans, "radar_front")) == ("sensor", False, ())
    assert decided(origin_of(in_body, "base_link"))[1:] == (False, OPEN)


def test_what_the_user_says_decides():
    scans, mount = scans_of("imaging"), mount_of(CORNER)
    assert decided(origin_of(scans, "radar_front", mount, stated="body"))[1:] == (True, ())
    assert decided(origin_of(moved(scans, mount), "base_link", mount, stated="sensor"))[1:] == (False, ())
    assert decided(origin_of(scans, "radar_front", stated="body"))[1:] == (False, OPEN)
    (warning,) = origin_of(scans, "radar_front", stated="body").warnings
    assert warning.facts == {
        "frame": "radar_front",
        "by_name": "sensor",
        "by_data": "sensor",
        "mounted": False,
        "stated": True,
        "place_m": (),
    }


@pytest.mark.parametrize("numbers", MOUNTS)
def test_the_bins_of_moved_returns_show_where_they_were_measured(numbers):
    scans = scans_of("imaging")
    found = origin_of(moved(scans, mount_of(numbers)), "radar_front")
    assert decided(found) == ("body", False, OPEN)
    assert found.place_m is not None
    np.testing.assert_allclose(found.place_m, numbers[:3], atol=0.02)
    for apart in (
        smooth(scans, np.random.default_rng(1)),
        moved(smooth(scans, np.random.default_rng(1)), mount_of(numbers)),
    ):
        assert origin_of(apart, "radar_front").by_data == "unknown"


def smooth(scans: RadarScans, rng: np.random.Generator) -> RadarScans:
    """Return the same returns as of a radar that interpolates: on no bins."""
    return replace(scans, points_radar_m=scans.points_radar_m + 0.05 * rng.standard_normal(scans.points_radar_m.shape))


@pytest.mark.parametrize("numbers", MOUNTS)
def test_returns_without_bins_are_never_taken_for_the_other_ones(numbers):
    scans, mount = smooth(scans_of("imaging"), np.random.default_rng(1)), mount_of(numbers)
    assert origin_of(moved(scans, mount), "base_link", mount).by_data != "sensor"
    assert origin_of(scans, "base_link", mount).by_data != "body"
    if numbers is not ROOF:  # behind whose mount the scene has nothing
        assert origin_of(scans, "base_link", mount).by_data == "sensor"


@pytest.mark.parametrize(("step_m", "seed", "every"), [(0.2, 1, 1), (0.001, 1, 1), (0.001, 3, 1), (0.001, 3, 4)])
def test_rounded_coordinates_are_no_bins_of_a_radar(step_m, seed, every):
    scans = smooth(scans_of("imaging"), np.random.default_rng(seed))
    rounded = replace(scans, points_radar_m=np.round(scans.points_radar_m / step_m) * step_m)
    in_front = rounded.take(np.flatnonzero(rounded.points_radar_m[:, 0] > FRONT[0] + 0.1)[::every])
    for numbers in (FRONT, (3.6, 0.8, 0.0, 0.0, 0.0, 0.0)):
        assert origin_of(in_front, "radar_front", mount_of(numbers)).by_data == "unknown"


def driven(mount: RigidTransform, rng: np.random.Generator, *, speed_mps: float) -> RadarScans:
    """Return scans of standing points, on no bins, from a moving vehicle, as a radar at a mount sees them, with some cars."""
    scans = []
    for number in range(20):
        polar = rng.uniform([5.0, -1.0, -0.1], [40.0, 1.0, 0.1], (60, 3))
        range_m, azimuth, elevation = polar.T
        level = np.cos(elevation)
        lines = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)
        velocity = mount.rotation.T @ np.array([speed_mps, 0.3, 0.0])
        doppler = -lines @ velocity + 0.03 * rng.standard_normal(60)
        doppler[:8] += rng.uniform(-10.0, 10.0, 8)
        scans.append(
            RadarScan(
                TimeNs(number * NS_PER_S),
                lines * range_m[:, None],
                doppler,
                np.full(60, 10.0),
                np.full((60, 3), np.nan),
            )
        )
    return RadarScans.from_scans(scans)


@pytest.mark.parametrize("numbers", [FRONT, CORNER])
def test_the_speeds_of_standing_things_show_where_the_radar_is(numbers):
    mount = mount_of(numbers)
    for speed_mps, sensor, body in ((8.0, "sensor", "body"), (0.0, None, None)):
        scans = driven(mount, np.random.default_rng(3), speed_mps=speed_mps)
        in_body = moved(scans, mount)
        if sensor is None:
            scans, in_body = (replace(one, doppler_mps=np.zeros_like(one.doppler_mps)) for one in (scans, in_body))
        of_sensor, of_body = origin_of(scans, "radar", mount), origin_of(in_body, "radar", mount)
        assert np.isnan(of_body.figures[0].doppler_mps) == (sensor is None)
        if sensor is not None:
            assert (of_sensor.by_data, of_body.by_data) == (sensor, body)
            assert of_body.figures[1].doppler_mps == pytest.approx(0.02, abs=0.01)


@pytest.mark.parametrize(
    ("frame", "origin"),
    [
        ("base_link", "body"),
        ("robot/base_link", "body"),
        ("ego_vehicle", "body"),
        ("radar_front", "sensor"),
        ("", "unknown"),
    ],
)
def test_a_frame_is_a_bodys_by_its_name(frame, origin):
    assert named_origin(frame) == origin


@pytest.mark.parametrize("numbers", MOUNTS)
def test_a_mount_comes_back_in_its_numbers(numbers):
    np.testing.assert_allclose(mount_numbers(mount_of(numbers)), numbers, atol=1e-9)
