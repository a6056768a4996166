"""The cluster scale follows the radar's scatter, and is left alone where the radar is fine."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.association.cluster_scale import cluster_scale
from calib_core.association.clustering import CLUSTER_SCALE, clusters_of
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.synthetic import RADAR_PROFILES, RadarProfile
from calib_core.synthetic.radar_returns import Targets, measure

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
def test_fine_radars_keep_the_least_scale(name: str) -> None:
    scans = scans_by(RADAR_PROFILES[name])  # type: ignore[index]
    assert cluster_scale([scans]).tolist() == CLUSTER_SCALE.tolist()


def test_a_radar_that_scatters_more_gets_a_wider_scale() -> None:
    sigma = np.array([0.15, COARSE.azimuth_sigma, COARSE.elevation_sigma])
    assert cluster_scale([scans_by(COARSE)]) == pytest.approx(1.75 * sigma, rel=0.3)


def test_nearly_all_scans_of_a_coarse_radar_are_in_the_clusters() -> None:
    kept: list[float] = []
    for seed in range(5):
        scans = scans_by(COARSE, seed=seed)
        found = clusters_of(scans, most=20, scale=cluster_scale([scans]))
        kept += sorted((cluster.persistence for cluster in found), reverse=True)[: len(THINGS)]
        assert max(cluster.persistence for cluster in clusters_of(scans, most=20)) < 0.6
    assert np.mean(np.array(kept) >= 0.85) >= 0.95
    assert min(kept) > 0.7


def test_coarse_bins_widen_the_scale_although_most_differences_are_zero() -> None:
    profile = replace(RADAR_PROFILES["awr1843"], range_bin_m=0.2)
    between_bins = np.array([[6.1, 0.0, 0.0]])
    scans = scans_by(profile, scans=60, things=np.concatenate([THINGS, between_bins]))
    assert cluster_scale([scans])[0] == pytest.approx(0.12, rel=0.05)
    assert max(cluster.persistence for cluster in clusters_of(scans, most=20, scale=cluster_scale([scans]))) > 0.9


def test_the_scale_has_a_limit() -> None:
    wild = replace(COARSE, range_sigma_m=3.0, azimuth_sigma=0.5, elevation_sigma=0.5)
    assert (cluster_scale([scans_by(wild)]) <= 5.0 * CLUSTER_SCALE + 1e-12).all()


def test_no_scans_one_scan_and_empty_scans_keep_the_least_scale() -> None:
    empty = RadarScan(TimeNs(0), np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros((0, 3)))
    for scans in (RadarScans(), scans_by(COARSE, scans=1), RadarScans.from_scans([empty, empty])):
        assert cluster_scale([scans]).tolist() == CLUSTER_SCALE.tolist()
    assert cluster_scale([]).tolist() == CLUSTER_SCALE.tolist()
