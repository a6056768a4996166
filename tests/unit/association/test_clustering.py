"""Clusters of a window, and the scores that select the reflector."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.association.clustering import (
    CLUSTER_SCALE,
    candidate_at,
    candidates_of,
    cluster_scale,
    clusters_of,
    floor_sigma_polar,
    window_around,
)
from calib_core.association.pairing import scores_of
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.options import LocatingOptions, NoiseOptions
from calib_core.synthetic.radar_returns import RADAR_PROFILES, RadarProfile, Targets, measure
from tests.scans import scan_of

REFLECTOR = (8.0, 1.0, -1.0)
POST = (5.0, -2.0, 0.3)


def window(
    objects: dict[tuple[float, float, float], float], *, start_s: float = 0.0, scans: int = 30, seed: int = 0
) -> RadarScans:
    """Thirty scans of objects with their SNR [dB], 1 cm and 0.1 deg of noise."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(scans):
        points = np.array(list(objects)) + 0.01 * rng.standard_normal((len(objects), 3))
        snr = np.array(list(objects.values())) + rng.standard_normal(len(objects))
        made.append(scan_of(start_s + 0.1 * k, points, snr_db=snr))
    return RadarScans.from_scans(made)


def test_two_objects_are_two_clusters_and_never_one_mean():
    clusters = clusters_of(window({REFLECTOR: 30.0, POST: 25.0}), most=6)
    assert len(clusters) == 2
    ranges = sorted(cluster.centre[0] for cluster in clusters)
    assert ranges == pytest.approx(sorted(np.linalg.norm([POST, REFLECTOR], axis=1)), abs=0.01)


def test_a_cluster_counts_the_scans_it_was_seen_in():
    (cluster,) = clusters_of(window({REFLECTOR: 30.0}, scans=20), most=6)
    assert (cluster.scans, cluster.returns, cluster.persistence) == (20, 20, 1.0)
    assert cluster.snr_db == pytest.approx(30.0, abs=1.0)


def test_windows_that_differ_in_snr_alone_have_clusters_of_their_own():
    weak, strong = window({REFLECTOR: 20.0}), window({REFLECTOR: 30.0})
    assert np.array_equal(weak.points_radar_m, strong.points_radar_m)
    (first,), (second,) = clusters_of(weak, most=6), clusters_of(strong, most=6)
    assert second.snr_db - first.snr_db == pytest.approx(10.0)


def test_an_empty_window_has_no_cluster():
    assert clusters_of(RadarScans(), most=6) == ()


def test_a_new_cluster_scores_above_a_permanent_stronger_one():
    places = [(8.0, 1.0, -1.0), (6.0, 0.5, -1.0), (10.0, -1.5, -1.0), (4.0, 0.0, -1.0)]
    windows = [window({place: 20.0, POST: 35.0}, start_s=100.0 * i, seed=i) for i, place in enumerate(places)]
    clusters = [clusters_of(one, most=6) for one in windows]
    for place, found, scores in zip(places, clusters, scores_of(windows, clusters), strict=True):
        best = candidates_of(found, scores, LocatingOptions(), NoiseOptions())[0]
        assert best.position_radar_m == pytest.approx(place, abs=0.02)
        assert scores.sum() == pytest.approx(1.0)


def test_windows_of_the_same_placement_do_not_lower_its_novelty():
    windows = [window({REFLECTOR: 20.0, POST: 21.0}, start_s=0.5 * i) for i in range(5)]
    clusters = [clusters_of(one, most=6) for one in windows]
    for scores in scores_of(windows, clusters):
        assert scores.min() > 0.3


def test_sigma_keeps_its_floor_however_many_returns_are_averaged():
    found = clusters_of(window({REFLECTOR: 30.0}, scans=300), most=6)
    (candidate,) = candidates_of(found, np.ones(1), LocatingOptions(), NoiseOptions())
    floor = floor_sigma_polar(candidate.position_radar_m, NoiseOptions())
    assert (candidate.sigma_polar >= floor).all()
    assert candidate.sigma_polar == pytest.approx(floor, rel=0.05)


def test_sigmas_in_the_message_replace_the_assumed_ones():
    plain = window({REFLECTOR: 30.0})
    with_sigmas = RadarScans(
        plain.times_ns,
        plain.first_return,
        plain.points_radar_m,
        plain.doppler_mps,
        plain.snr_db,
        np.tile([0.1, 0.02, 0.04], (len(plain.points_radar_m), 1)),
    )
    (candidate,) = candidates_of(clusters_of(with_sigmas, most=6), np.ones(1), LocatingOptions(), NoiseOptions())
    assert candidate.sigma_polar == pytest.approx([0.1, 0.02, 0.04], rel=0.02)


def test_the_assumed_angle_noise_grows_to_the_side():
    ahead = candidate_at(np.array([10.0, 0.0, 0.0]), NoiseOptions())
    assert ahead.sigma_polar == pytest.approx(floor_sigma_polar(np.array([10.0, 0.0, 0.0]), NoiseOptions()))
    sideways = floor_sigma_polar(np.array([5.0, 5.0, 0.0]), NoiseOptions())
    assert sideways[1] == pytest.approx(np.sqrt(2.0) * ahead.sigma_polar[1])


def test_the_window_is_centred_on_the_nearest_scan():
    scans = window({REFLECTOR: 30.0}, scans=100)
    cut = window_around(scans, TimeNs(round(5.04 * NS_PER_S)), window_s=3.0)
    assert (cut.times_ns[0], cut.times_ns[-1]) == (round(3.5 * NS_PER_S), round(6.5 * NS_PER_S))


def test_at_most_the_wanted_number_of_candidates_is_kept():
    objects = {(3.0 + i, 0.5 * i - 2.0, 0.0): 25.0 for i in range(10)}
    found = clusters_of(window(objects), most=24)
    assert len(found) == 10
    assert len(candidates_of(found, np.full(10, 0.1), LocatingOptions(max_candidates=4), NoiseOptions())) == 4


COARSE = replace(
    RADAR_PROFILES["imaging"],
    range_sigma_m=0.15,
    azimuth_sigma=float(np.deg2rad(1.5)),
    elevation_sigma=float(np.deg2rad(3.0)),
    resolution_azimuth=0.1,
)
THINGS = np.array([[6.0, 1.0, -0.8], [9.0, -2.0, 0.2], [12.0, 3.0, -0.5], [4.0, -1.0, -0.7]])


def scans_by(profile: RadarProfile, *, scans: int = 30, seed: int = 0, things: np.ndarray = THINGS) -> RadarScans:
    """Scans of a few objects at rest."""
    rng = np.random.default_rng(seed)
    n = len(things)
    targets = Targets(
        things, np.zeros(n), np.full(n, 14.0), np.full(n, 1.0), np.zeros((n, 3)), np.zeros(n, dtype=np.bool_)
    )
    return RadarScans.from_scans(
        [measure(rng, targets, profile=profile, time=TimeNs(k * NS_PER_S // 10)).scan for k in range(scans)]
    )


@pytest.mark.parametrize("name", ["awr1843", "imaging"])
def test_fine_radars_keep_the_least_scale(name):
    scans = scans_by(RADAR_PROFILES[name])
    assert cluster_scale([scans]).tolist() == CLUSTER_SCALE.tolist()


def test_a_radar_that_scatters_more_gets_a_wider_scale():
    sigma = np.array([0.15, COARSE.azimuth_sigma, COARSE.elevation_sigma])
    assert cluster_scale([scans_by(COARSE)]) == pytest.approx(1.75 * sigma, rel=0.3)


def test_nearly_all_scans_of_a_coarse_radar_are_in_the_clusters():
    kept: list[float] = []
    for seed in range(5):
        scans = scans_by(COARSE, seed=seed)
        found = clusters_of(scans, most=20, scale=cluster_scale([scans]))
        kept += sorted((cluster.persistence for cluster in found), reverse=True)[: len(THINGS)]
        assert max(cluster.persistence for cluster in clusters_of(scans, most=20)) < 0.6
    assert np.mean(np.array(kept) >= 0.85) >= 0.95
    assert min(kept) > 0.7


def test_coarse_bins_widen_the_scale_although_most_differences_are_zero():
    profile = replace(RADAR_PROFILES["awr1843"], range_bin_m=0.2)
    between_bins = np.array([[6.1, 0.0, 0.0]])
    scans = scans_by(profile, scans=60, things=np.concatenate([THINGS, between_bins]))
    assert cluster_scale([scans])[0] == pytest.approx(0.12, rel=0.05)
    assert max(cluster.persistence for cluster in clusters_of(scans, most=20, scale=cluster_scale([scans]))) > 0.9


def test_the_scale_has_a_limit():
    wild = replace(COARSE, range_sigma_m=3.0, azimuth_sigma=0.5, elevation_sigma=0.5)
    assert (cluster_scale([scans_by(wild)]) <= 5.0 * CLUSTER_SCALE + 1e-12).all()


def test_no_scans_one_scan_and_empty_scans_keep_the_least_scale():
    empty = scan_of(0.0, [])
    for scans in (RadarScans(), scans_by(COARSE, scans=1), RadarScans.from_scans([empty, empty])):
        assert cluster_scale([scans]).tolist() == CLUSTER_SCALE.tolist()
    assert cluster_scale([]).tolist() == CLUSTER_SCALE.tolist()
