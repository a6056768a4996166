"""What was there all the time has a far lower score than what appears with the placement."""

import numpy as np
import pytest

from calib_core.association.clustering import candidates_of, clusters_of, window_around
from calib_core.association.novelty import background_windows, scores_of
from calib_core.association.pairing import pair_clicks
from calib_core.calibration import calibrate
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions, LocatingOptions, NoiseOptions
from calib_core.results import Calibration
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.scans import simulate_scans

POST = (3.5, 0.1, 0.2)
PLACES = tuple((8.0 + 0.5 * i, 1.0 - 0.4 * i, -1.0) for i in range(8))


def recording(*, dwells: int = 8, seed: int = 0) -> RadarScans:
    """A post that is always there and 25 dB stronger than a reflector, which rests for six of every fifteen seconds."""
    rng = np.random.default_rng(seed)
    scans = []
    for k in range(150 * len(PLACES)):
        i, since_s = divmod(k / 10.0, 15.0)
        there = [POST, PLACES[int(i)]] if i < dwells and 5.0 <= since_s < 11.0 else [POST]
        points = np.array(there) + 0.01 * rng.standard_normal((len(there), 3))
        snr = np.array([45.0, 20.0][: len(there)]) + rng.standard_normal(len(there))
        n = len(there)
        scans.append(RadarScan(TimeNs(k * NS_PER_S // 10), points, np.zeros(n), snr, np.full((n, 3), np.nan)))
    return RadarScans.from_scans(scans)


def click(placement: int) -> ReflectorClick:
    return ReflectorClick(TimeNs((15 * placement + 8) * NS_PER_S), f"c{placement}", 100.0 * placement, 50.0)


def test_what_other_windows_show_too_is_no_candidate() -> None:
    scans = recording()
    windows = [window_around(scans, click(i).image_time, window_s=3.0) for i in range(8)]
    clusters = [clusters_of(window, most=12) for window in windows]
    for place, found, scores in zip(PLACES, clusters, scores_of(windows, clusters), strict=True):
        (only,) = candidates_of(found, scores, LocatingOptions(), NoiseOptions())
        assert only.position_radar_m == pytest.approx(place, abs=0.02)


def test_one_click_is_enough_where_the_rest_of_the_recording_shows_the_background() -> None:
    (pair,) = pair_clicks([click(3)], recording(), CalibrationOptions(), background=recording()).pairs
    assert pair.candidates[0].position_radar_m == pytest.approx(PLACES[3], abs=0.02)
    assert pair.candidates[0].score > 0.95


def test_background_windows_are_clear_of_every_click_and_few() -> None:
    scans = recording()
    windows = [window_around(scans, click(i).image_time, window_s=3.0) for i in (1, 5)]
    background = background_windows(scans, windows, window_s=3.0)
    assert 8 < len(background) <= 16
    for empty in background:
        for window in windows:
            assert empty.times_ns[0] > window.times_ns[-1] or empty.times_ns[-1] < window.times_ns[0]


def test_scans_around_the_clicks_alone_have_no_background_windows() -> None:
    around = recording().between(TimeNs(19 * NS_PER_S), TimeNs(27 * NS_PER_S))
    window = window_around(around, click(1).image_time, window_s=3.0)
    assert background_windows(around, [window], window_s=3.0) == ()
    assert background_windows(RadarScans(), [], window_s=3.0) == ()


def test_in_a_busy_window_more_candidates_are_kept_than_in_a_clear_one() -> None:
    clear = np.array([0.97, 0.02, 0.005, 0.005])
    busy = np.full(30, 1.0 / 30.0)
    found = clusters_of(recording().between(TimeNs(0), TimeNs(3 * NS_PER_S)), most=1)
    for scores, kept in ((clear, 2), (busy, 16)):
        clusters = found * len(scores)
        assert len(candidates_of(clusters, scores, LocatingOptions(), NoiseOptions())) == kept


@pytest.mark.slow
def test_no_static_object_replaces_the_reflector_in_a_heavily_cluttered_aisle() -> None:
    session = simulate_scans(SimulationOptions(seed=880001, scene="aisle", clutter="heavy"))
    outcome = calibrate(session.clicks, session.scans, session.camera)
    assert isinstance(outcome, Calibration)
    for pair, placement in zip(outcome.pairs, session.placements, strict=True):
        assert np.linalg.norm(pair.point_radar_m - placement.position_radar_m) < 0.6
    error = session.camera_from_radar.error_from(outcome.camera_from_radar)
    assert error @ np.linalg.solve(outcome.covariance, error) < 1.5 * outcome.covariance_quantile
