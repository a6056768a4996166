"""Simulated radars that are not perfect: each defect is measured in the returns."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calib_core.geometry import rotation_angle_rad
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.radar import cartesian_from_polar, direction_cosines, polar_from_cartesian
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.recordings.containers.writing import CameraInfoMessage, CloudMessage, write_ros1_bag
from calib_core.synthetic.files import (
    CLOUD_TOPIC,
    SECOND_COLUMN,
    SECOND_SUFFIX,
    camera_messages,
    radar_messages,
    truth_text,
)
from calib_core.synthetic.options import IntrinsicsErrors, RadarDefects, SimulationOptions
from calib_core.synthetic.radar_returns import RADAR_PROFILES, Targets, measure, radar_from_reported, second_azimuths
from calib_core.synthetic.recording import simulate
from calib_core.synthetic.rig import RigOptions, radar_stand

QUIET = SimulationOptions(
    radar="imaging", placements=6, dwell_s=3.5, radar_rate_hz=5.0, clutter="none", person=False, seed=3
)
EXACT = replace(
    RADAR_PROFILES["imaging"],
    range_bin_m=1e-4,
    range_sigma_m=0.0,
    azimuth_sigma=0.0,
    elevation_sigma=0.0,
    calibration_azimuth=0.0,
    calibration_elevation=0.0,
    false_alarms=0.0,
)
PLACES = np.array([[4.0, 2.0, -0.5], [6.0, -3.0, 0.6], [9.0, 4.0, 1.0], [12.0, -1.0, -1.5]])


def _reported(defects: RadarDefects) -> np.ndarray:
    """Measure strong targets without noise: their reported polar coordinates (4, 3)."""
    targets = Targets(PLACES, np.zeros(4), np.full(4, 20.0), np.zeros(4), np.zeros((4, 3)), np.zeros(4, dtype=bool))
    found = np.full((4, 3), np.nan)
    for seed in range(20):  # a scan misses a target now and then, and adds side lobes
        scan = measure(np.random.default_rng(seed), targets, profile=EXACT, time=TimeNs(0), defects=defects).scan
        loud = scan.snr_db > scan.snr_db.max() - 20.0
        if len(scan) == 4 and loud.all():
            found = scan.points_radar_m
    return polar_from_cartesian(found)


def _windows(options: SimulationOptions) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return, for each placement, its true position and the returns (n, 3) while it stands."""
    session = simulate(options)
    return [(p.position_radar_m, session.scans.between(p.start, p.end).points_radar_m) for p in session.placements]


def _strongest(options: SimulationOptions) -> tuple[np.ndarray, np.ndarray]:
    """Return the true polar coordinates of each placement and the medians of its reported ones, both (n, 3)."""
    session = simulate(options)
    medians = []
    for placement in session.placements:
        window = session.scans.between(placement.start, placement.end)
        range_m = np.linalg.norm(window.points_radar_m, axis=1)
        near = np.abs(range_m - np.linalg.norm(placement.position_radar_m)) < 0.6
        medians.append(np.median(polar_from_cartesian(window.points_radar_m[near]), axis=0))
    return polar_from_cartesian(session.points_radar_m), np.array(medians)


@pytest.mark.parametrize(
    ("defects", "factor", "offset"),
    [
        (RadarDefects(azimuth_scale=1.03), (1.0, 1.03, 1.0), (0.0, 0.0, 0.0)),
        (RadarDefects(elevation_scale=0.9), (1.0, 1.0, 0.9), (0.0, 0.0, 0.0)),
        (RadarDefects(range_scale=1.01, range_bias_m=0.12), (1.01, 1.0, 1.0), (0.12, 0.0, 0.0)),
        (RadarDefects(azimuth_bias_deg=2.0), (1.0, 1.0, 1.0), (0.0, np.deg2rad(2.0), 0.0)),
        (RadarDefects(elevation_bias_deg=-1.5), (1.0, 1.0, 1.0), (0.0, 0.0, np.deg2rad(-1.5))),
    ],
)
def test_scales_and_biases_act_on_range_azimuth_and_elevation(defects, factor, offset):
    true = polar_from_cartesian(PLACES)
    assert _reported(defects) == pytest.approx(true[np.argsort(true[:, 0])] * factor + offset, abs=1e-4)


def test_biases_turn_the_frame_in_which_the_radar_reports():
    defects = RadarDefects(azimuth_bias_deg=3.0)
    points_radar = radar_from_reported(defects) @ cartesian_from_polar(_reported(defects))
    assert points_radar == pytest.approx(PLACES[np.argsort(np.linalg.norm(PLACES, axis=1))], abs=1e-3)
    ahead = radar_from_reported(RadarDefects(elevation_bias_deg=2.0)) @ np.array([[np.cos(0.1), 0.0, np.sin(0.1)]])
    assert polar_from_cartesian(ahead)[0, 2] == pytest.approx(0.1 - np.deg2rad(2.0))


def test_the_truth_file_holds_the_pose_of_the_reported_frame_if_it_is_another_one():
    plain, biased = (
        json.loads(truth_text(simulate(replace(QUIET, placements=1, defects=RadarDefects(azimuth_bias_deg=bias_deg)))))
        for bias_deg in (0.0, 30.0)
    )
    assert "camera_from_reported" not in plain
    assert biased["camera_from_radar"] == plain["camera_from_radar"]
    turned = np.array(biased["camera_from_radar"]["rotation"]).T @ biased["camera_from_reported"]["rotation"]
    assert rotation_angle_rad(turned) == pytest.approx(np.deg2rad(30.0))


def test_a_driver_may_report_y_to_the_right_and_millimetres():
    plain, mirrored, fine = (
        cartesian_from_polar(_reported(defects))
        for defects in (RadarDefects(), RadarDefects(mirrored=True), RadarDefects(length_unit_m=0.001))
    )
    assert mirrored == pytest.approx(plain * [1.0, -1.0, 1.0], abs=1e-5)
    assert fine == pytest.approx(plain * 1000.0, rel=1e-5)


def test_the_published_intrinsics_may_be_wrong_while_the_images_and_the_truth_are_not():
    wrong = IntrinsicsErrors(focal_length_scale=1.02, principal_point_px=(30.0, -10.0))
    recording = simulate(replace(QUIET, placements=1, intrinsics=wrong, width_px=64, height_px=64, camera_rate_hz=1.0))
    [info, *_] = [m.body for m in camera_messages(recording) if isinstance(m.body, CameraInfoMessage)]
    true, published = recording.camera.matrix_px, info.camera.matrix_px
    assert np.diag(published)[:2] / np.diag(true)[:2] == pytest.approx(1.02)
    assert published[:2, 2] - true[:2, 2] == pytest.approx([30.0, -10.0])
    assert json.loads(truth_text(recording))["camera"]["matrix_px"] == true.tolist()


def test_in_a_recording_reported_over_true_azimuth_is_the_scale():
    true, reported = _strongest(replace(QUIET, placements=12, defects=RadarDefects(azimuth_scale=1.05)))
    assert float(true[:, 1] @ reported[:, 1] / (true[:, 1] @ true[:, 1])) == pytest.approx(1.05, abs=0.01)


def test_a_2d_radar_reports_no_elevation_but_the_slant_range():
    tilted = replace(QUIET, rig=replace(QUIET.rig, radar_tilt_deg=10.0), defects=RadarDefects(elevation="zero"))
    assert not np.concatenate([points[:, 2] for _, points in _windows(tilted)]).any()
    true, reported = _strongest(tilted)
    assert np.abs(true[:, 2]).max() > np.deg2rad(4.0)
    assert reported[:, 0] == pytest.approx(true[:, 0], abs=0.05)
    assert reported[:, 1] == pytest.approx(true[:, 1], abs=np.deg2rad(1.0))


def test_bins_are_as_wide_as_asked():
    defects = RadarDefects(range_bin_m=0.15, azimuth_bins=32, elevation_bins=128)
    r, u, w = direction_cosines(simulate(replace(QUIET, defects=defects)).scans.points_radar_m).T
    for values, width in ((r, 0.15), (u, 2.0 / 32.0), (w, 2.0 / 128.0)):
        assert np.abs(values / width - np.round(values / width)).max() < 1e-4


@pytest.mark.slow
def test_returns_scatter_from_scan_to_scan_as_asked():
    coarse = RadarDefects(scatter_range_m=0.15, scatter_azimuth_deg=1.5, scatter_elevation_deg=3.0)
    spreads = []
    for true, points in _windows(replace(QUIET, radar_rate_hz=20.0, defects=coarse)):
        error = polar_from_cartesian(points) - polar_from_cartesian(true[None])
        error = error[(np.abs(error) < [0.6, 0.15, 0.3]).all(axis=1)]
        spreads.append(1.4826 * np.median(np.abs(error - np.median(error, axis=0)), axis=0))
    assert np.median(spreads, axis=0) == pytest.approx([0.15, np.deg2rad(1.5), np.deg2rad(3.0)], rel=0.25)


@pytest.mark.slow
def test_near_and_far_scans_come_in_two_topics_at_their_own_rates_and_overlap():
    near_and_far = replace(QUIET, clutter="scene", defects=RadarDefects(near_and_far=True))
    messages = list(radar_messages(simulate(replace(near_and_far, placements=3)), 1))
    assert [m.receive_time for m in messages] == sorted(m.receive_time for m in messages)
    ranges: dict[str, np.ndarray] = {}
    for name, rate_hz in (("near", 25.0), ("far", 20.0)):
        clouds = [m.body for m in messages if m.topic == f"{CLOUD_TOPIC}_{name}" and isinstance(m.body, CloudMessage)]
        steps_s = np.diff([int(cloud.stamp) for cloud in clouds]) / NS_PER_S
        assert 1.0 / float(np.median(steps_s)) == pytest.approx(rate_hz, rel=0.01)
        points = np.concatenate([cloud.values for cloud in clouds])
        ranges[name] = np.linalg.norm(points[points[:, 4] == 0.0, :3], axis=1)
    assert np.quantile(ranges["near"], 0.98) < 10.2
    assert np.quantile(ranges["far"], 0.02) > 4.8
    assert {m.topic for m in messages} == {f"{CLOUD_TOPIC}_near", f"{CLOUD_TOPIC}_far"}


@pytest.mark.slow
def test_a_session_without_images_has_the_scans_of_both_antennas():
    session = simulate(replace(QUIET, placements=2, defects=RadarDefects(near_and_far=True)))
    assert len(session.scans) == sum(len(antenna.times) for antenna in session.stage.antennas)
    assert (np.diff(session.scans.times_ns) > 0).all()


@pytest.mark.parametrize("where", ["column", "topic"])
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_one_of_two_azimuths_is_the_true_one(where, share):
    defects = RadarDefects(second_azimuth=where, second_azimuth_share=share)
    recording = simulate(replace(QUIET, placements=3, defects=defects))
    messages = [m for m in radar_messages(recording, 1) if isinstance(m.body, CloudMessage)]
    for placement in recording.placements:
        true = polar_from_cartesian(placement.position_radar_m[None])[0]
        first, second = [], []
        for message in messages:
            assert isinstance(message.body, CloudMessage)
            if not placement.start < message.body.stamp < placement.end:
                continue
            polar = polar_from_cartesian(message.body.values[:, :3].astype(float))
            near = np.abs(polar[:, 0] - true[0]) < 0.1
            (second if message.topic.endswith(SECOND_SUFFIX) else first).extend(polar[near, 1])
            if where == "column":
                assert message.body.names[-1] == SECOND_COLUMN
                second.extend(message.body.values[near, -1])
        assert len(first) == len(second) > 10
        right, wrong = (first, second) if share == 0.0 else (second, first)
        assert np.median(right) == pytest.approx(true[1], abs=np.deg2rad(1.0))
        assert abs(np.median(wrong) - true[1]) > np.deg2rad(20.0)


@pytest.mark.parametrize("where", ["column", "topic"])
def test_a_recording_with_two_azimuths_is_read_with_both_as_alternatives(where, tmp_path):
    recording = simulate(replace(QUIET, placements=2, clutter="scene", defects=RadarDefects(second_azimuth=where)))
    path = write_ros1_bag(tmp_path / "radar.bag", radar_messages(recording, 1))
    with open_recording([path], RecordingOptions(), require=("radar",)) as opened:
        scans = opened.radar_scans()
    measured = list(recording.scans_of(recording.stage.antennas[0]))
    assert len(scans) == len(measured)
    assert scans.alternative_of is not None
    for number in (0, 40, len(measured) - 1):
        scan, points = scans.scan(number), measured[number].points_radar_m
        expected = np.concatenate([points, second_azimuths(points)])
        assert scan.points_radar_m == pytest.approx(expected, abs=1e-4)
        assert scan.alternative_of.tolist() == [*range(len(points)), *range(len(points))]


def test_without_defects_no_draw_changes():
    plain, other = simulate(QUIET), simulate(replace(QUIET, defects=RadarDefects(azimuth_scale=1.01)))
    assert np.array_equal(plain.scans.times_ns, other.scans.times_ns)
    assert len(plain.scans.points_radar_m) == pytest.approx(len(other.scans.points_radar_m), abs=5)
    assert plain.clicks == other.clicks


def test_a_radar_leans_to_its_right():
    left_m, right_m = (
        (radar_stand(RigOptions(radar_roll_deg=5.0)).inverse() @ np.array([[0.0, y_m, 0.0]]))[0, 2]
        for y_m in (1.0, -1.0)
    )
    assert left_m - right_m == pytest.approx(2.0 * np.sin(np.deg2rad(5.0)) * np.cos(np.deg2rad(10.0)))
