"""Still returns say how a radar turned; what moves, and too few places, say nothing."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.geometry import rotation_exp
from calib_core.measurements import RadarScan, RadarScans, TimeNs
from calib_core.watching.still_returns import radar_turn, still_places

PLACES_M = np.array(
    [[8.0, 3.0, 0.5], [12.0, -6.0, 1.0], [20.0, 2.0, 2.0], [25.0, -9.0, 0.2], [30.0, 14.0, 3.0], [15.0, 9.0, 1.5]]
)


def scans(rng: np.random.Generator, turn_deg: tuple[float, float, float], *, flat: bool = False) -> RadarScans:
    """Return ten seconds in which a radar turned by an angle (of what it sees) sees six still places and one that moves."""
    rotation = rotation_exp(np.deg2rad(turn_deg))
    every = []
    for number in range(100):
        seen = PLACES_M[rng.uniform(size=len(PLACES_M)) < 0.8] @ rotation.T
        walker = np.array([[10.0, -4.0 + 0.1 * number, 0.0]])
        points = np.concatenate([seen, walker])
        range_m = np.linalg.norm(points, axis=1, keepdims=True)
        points = (
            points
            + rng.normal(size=points.shape) * [0.03, 0.0, 0.0]
            + rng.normal(size=points.shape) * range_m * [0, 0.01, 0.02]
        )
        if flat:
            points[:, 2] = 0.0
        doppler = np.append(np.zeros(len(seen)), 1.0)
        nan = np.full(len(points), np.nan)
        every.append(RadarScan(TimeNs(10**8 * number), points, doppler, nan, np.full((len(points), 3), np.nan)))
    return RadarScans.from_scans(every)


@pytest.mark.parametrize("turn_deg", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.4), (0.0, 0.0, -5.0), (0.0, 1.0, 0.5)])
def test_a_turn_is_found(turn_deg):
    rng = np.random.default_rng(5)
    turn = radar_turn(still_places(scans(rng, (0.0, 0.0, 0.0))), scans(rng, turn_deg))

    assert turn is not None
    sigma = np.rad2deg(np.sqrt(np.diag(turn.covariance_rad2)))
    assert (np.abs(np.rad2deg(turn.rotation_rad) - turn_deg) < 4.0 * sigma).all()
    assert sigma[2] < 0.12
    assert turn.determined == (True, True, True)


def test_a_radar_without_elevation_sees_turns_about_its_vertical_only():
    rng = np.random.default_rng(6)
    turn = radar_turn(still_places(scans(rng, (0.0, 0.0, 0.0), flat=True)), scans(rng, (0.0, 0.0, 0.7), flat=True))

    assert turn is not None
    assert turn.determined == (False, False, True)
    assert np.rad2deg(turn.rotation_rad[2]) == pytest.approx(0.7, abs=0.15)


def test_without_enough_places_nothing_is_said():
    rng = np.random.default_rng(7)
    every = scans(rng, (0.0, 0.0, 0.0))
    places = still_places(every)

    assert len(places) == len(PLACES_M)
    assert radar_turn(places, RadarScans()) is None
    assert radar_turn(still_places(RadarScans()), every) is None
    assert len(still_places(RadarScans())) == 0


def test_a_radar_whose_azimuths_are_bins_does_not_know_turns_within_one():
    def binned(rng: np.random.Generator, turn_deg: float) -> RadarScans:
        measured = scans(rng, (0.0, 0.0, turn_deg))
        points = measured.points_radar_m
        range_m = np.linalg.norm(points, axis=1)
        true_y = np.round(points[:, 1] / range_m * 4.0) / 4.0  # a place stays in its bin, whatever the noise
        y, z = range_m * true_y, points[:, 2]
        x = np.sqrt(np.maximum(range_m**2 - y**2 - z**2, 0.01))
        return replace(measured, points_radar_m=np.stack([x, y, z], axis=1))

    rng = np.random.default_rng(8)
    turn = radar_turn(still_places(binned(rng, 0.0)), binned(rng, 0.3))

    assert turn is not None
    sigma = np.rad2deg(np.sqrt(turn.covariance_rad2[2, 2]))
    assert abs(np.rad2deg(turn.rotation_rad[2]) - 0.3) < 3.0 * sigma
    assert sigma > 1.0
