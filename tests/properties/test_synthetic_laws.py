"""Laws of the simulation, valid for any seed and any target."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.measurements import TimeNs
from calib_core.radar import direction_cosines
from calib_core.synthetic.radar_returns import RADAR_PROFILES, Targets, measure
from calib_core.synthetic.rendering.surfaces import line_coverage
from calib_core.synthetic.scene.person import PersonState, capsules
from calib_core.synthetic.timeline import draw_segments, draw_times

seeds = st.integers(0, 2**32 - 1)


@given(
    seed=seeds,
    points=arrays(np.float64, (6, 3), elements=st.floats(-25.0, 25.0)),
    velocity=arrays(np.float64, 6, elements=st.floats(-9.0, 9.0)),
    name=st.sampled_from(["awr1843", "imaging"]),
)
def test_whatever_is_in_front_a_scan_is_finite_forward_and_on_its_bins(seed, points, velocity, name):
    profile = RADAR_PROFILES[name]
    targets = Targets(
        points, velocity, np.full(6, 20.0), np.full(6, 3.0), np.zeros((6, 3)), np.zeros(6, dtype=np.bool_)
    )
    scan = measure(np.random.default_rng(seed), targets, profile=profile, time=TimeNs(1)).scan
    r, u, _ = direction_cosines(scan.points_radar_m).T
    assert np.isfinite(scan.points_radar_m).all()
    assert (scan.points_radar_m[:, 0] >= 0.0).all()
    assert (np.diff(r) > -1e-5).all()
    assert np.abs(r / profile.range_bin_m - np.round(r / profile.range_bin_m)).max(initial=0.0) < 2e-3
    assert np.abs(scan.doppler_mps).max(initial=0.0) <= 0.5 * profile.doppler_bins * profile.doppler_bin_mps + 1e-6
    if profile.angle_bins:
        assert np.abs(32.0 * u - np.round(32.0 * u)).max(initial=0.0) < 1e-3


@given(seed=seeds, hidden=arrays(np.bool_, 5))
def test_what_is_hidden_or_still_is_not_seen_or_not_moving(seed, hidden):
    points = np.stack([np.arange(4.0, 14.0, 2.0), np.zeros(5), np.zeros(5)], axis=1)
    targets = Targets(points, np.zeros(5), np.full(5, 15.0), np.zeros(5), np.zeros((5, 3)), hidden)
    scan = measure(np.random.default_rng(seed), targets, profile=RADAR_PROFILES["awr1843"], time=TimeNs(1)).scan
    loud = scan.snr_db > 20.0
    gaps = np.abs(np.linalg.norm(scan.points_radar_m[loud], axis=1)[:, None] - points[:, 0][None])
    assert (scan.doppler_mps[loud] == 0.0).all()
    assert not np.any((gaps < 0.06) & hidden[None])


@given(seed=seeds, rate_hz=st.floats(1.0, 30.0))
def test_both_clocks_of_a_sensor_always_rise(seed, rate_hz):
    times = draw_times(
        np.random.default_rng(seed),
        duration_s=10.0,
        rate_hz=rate_hz,
        latency_s=0.02,
        transfer_s=0.02,
    )
    assert (np.diff(times.header_ns) > 0).all()
    assert (np.diff(times.receive_ns) > 0).all()
    assert (times.receive_ns >= times.header_ns).all()


@settings(max_examples=25)
@given(seed=seeds, outliers=st.sampled_from([0.0, 0.2, 0.5]), decoys=st.integers(0, 3))
def test_the_seed_alone_decides_the_pairs_and_their_truth_projects(seed, outliers, decoys):
    first, again = (
        simulate_pairs(8, rng=np.random.default_rng(seed), outlier_share=outliers, decoys=decoys) for _ in range(2)
    )
    projected = first.camera.project(first.camera_from_radar @ first.points_radar_m)
    assert np.array_equal(first.pixels_px, again.pixels_px)
    assert all(np.array_equal(a.pixel_px, b.pixel_px) for a, b in zip(first.pairs, again.pairs, strict=True))
    assert np.array_equal(projected, first.pixels_px)
    assert first.outlier.sum() == round(8 * outliers)
    assert {len(pair.candidates) for pair in first.pairs} == {decoys + 1}


@given(
    heading=st.floats(-4.0, 4.0),
    walked=st.floats(0.0, 100.0),
    pace=st.floats(0.0, 1.0),
    crouch=st.floats(0.0, 1.0),
    carrying=st.booleans(),
)
def test_a_person_keeps_their_bones_and_stays_above_the_ground(heading, walked, pace, crouch, carrying):
    limbs = capsules(PersonState(3.0, 1.0, heading, walked, pace, crouch, carrying))
    lengths = [float(np.linalg.norm(limb.end_m - limb.start_m)) for limb in limbs if limb.surface == "trousers"]
    lowest = min(float(min(limb.start_m[2], limb.end_m[2])) for limb in limbs)
    highest = max(float(max(limb.start_m[2], limb.end_m[2])) for limb in limbs)
    assert sorted(lengths)[-4:] == pytest.approx([0.46, 0.46, 0.47, 0.47], abs=0.02)
    assert -0.02 < lowest < 0.2
    assert 0.5 < highest < 1.95


@given(at=st.floats(-50.0, 50.0), period=st.floats(0.05, 3.0), share=st.floats(0.01, 0.9), size=st.floats(1e-3, 10.0))
def test_a_pixel_is_never_covered_by_less_than_nothing_or_more_than_all(at, period, share, size):
    covered = line_coverage(np.array([at]), period_m=period, width_m=share * period, footprint_m=np.array([size]))
    assert -1e-6 <= covered[0] <= 1.0 + 1e-6


@given(seed=seeds, steps_s=st.lists(st.floats(4.0, 40.0), min_size=1, max_size=8))
def test_islands_keep_the_order_of_time_and_leave_minutes_between(seed, steps_s):
    middles_s = np.cumsum(steps_s)
    segments = draw_segments(np.random.default_rng(seed), middles_s)
    times_s = np.arange(0.0, middles_s[-1] + 20.0, 0.05)
    kept = times_s[segments.recorded(times_s)]
    recorded_s = kept + segments.delay_s(kept)
    steps = np.diff(recorded_s)
    assert segments.recorded(middles_s).all()
    assert (steps > 0.0).all()
    assert (steps[steps > 1.0] >= 60.0 - 1e-6).all()
    assert (steps > 1.0).sum() == len(middles_s) - 1
    for start_s, end_s in zip(middles_s - 1.0, middles_s + 1.0, strict=True):
        first_s, last_s = segments.first_after_s(float(start_s)), segments.last_before_s(float(end_s))
        middle_s = 0.5 * (start_s + end_s)
        assert first_s <= middle_s + float(segments.delay_s(np.array([middle_s]))[0]) <= last_s
