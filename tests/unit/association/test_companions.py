"""An object behind the reflector at every placement does not replace it because it echoes more."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.association.companions import balanced_pairs, find_companion
from calib_core.association.pairing import pair_clicks
from calib_core.measurements import NS_PER_S, Pair, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.synthetic import simulate_pairs


def with_second(offsets_m: np.ndarray, *, score: float, seed: int = 1, aside_rad: float = 0.0) -> list[Pair]:
    """Pairs with a second candidate that much farther away, and more plausible by its echo."""
    pairs = []
    for pair, offset_m in zip(
        simulate_pairs(len(offsets_m), rng=np.random.default_rng(seed)).pairs, offsets_m, strict=True
    ):
        own = pair.candidates[0]
        x, y, z = own.position_radar_m * (1.0 + offset_m / np.linalg.norm(own.position_radar_m))
        turned = np.array(
            [x * np.cos(aside_rad) - y * np.sin(aside_rad), x * np.sin(aside_rad) + y * np.cos(aside_rad), z]
        )
        second = replace(own, position_radar_m=turned, score=score)
        pairs.append(replace(pair, candidates=(second, replace(own, score=0.95 - score))))
    return pairs


def test_the_cart_behind_every_placement_is_found_with_its_distance() -> None:
    companion = find_companion(with_second(np.full(12, 1.0), score=0.6))
    assert companion is not None
    assert companion.offset_m == pytest.approx(1.0, abs=0.05)
    assert companion.near.tolist() == [1] * 12
    assert companion.far.tolist() == [0] * 12


def test_reflector_and_cart_get_nearly_the_same_score_and_keep_their_sum() -> None:
    for pair in balanced_pairs(with_second(np.full(12, 1.0), score=0.85)):
        near, far = pair.candidates
        assert np.linalg.norm(near.position_radar_m) < np.linalg.norm(far.position_radar_m)
        assert near.score / far.score == pytest.approx(1.5)
        assert near.score + far.score == pytest.approx(0.95)


@pytest.mark.parametrize(
    "pairs",
    [
        with_second(np.linspace(0.5, 3.9, 12), score=0.6),
        with_second(np.full(12, 1.0), score=0.6, aside_rad=0.3),
        with_second(np.full(12, 1.0), score=0.93),
        with_second(np.full(3, 1.0), score=0.6),
    ],
    ids=["ghosts at any distance", "next to the reflector", "implausible", "three pairs"],
)
def test_what_is_no_companion_changes_no_score(pairs: list[Pair]) -> None:
    assert find_companion(pairs) is None
    assert all(after is before for after, before in zip(balanced_pairs(pairs), pairs, strict=True))


def test_pairs_without_the_cart_are_left_alone() -> None:
    pairs = with_second(np.full(12, 1.0), score=0.6)
    pairs[4] = replace(pairs[4], candidates=pairs[4].candidates[1:])
    companion = find_companion(pairs)
    assert companion is not None
    assert companion.near[4] == companion.far[4] == -1
    assert balanced_pairs(pairs)[4] is pairs[4]


def test_clicks_of_a_reflector_in_front_of_a_cart_prefer_the_reflector() -> None:
    rng = np.random.default_rng(2)
    places = simulate_pairs(8, rng=rng).points_radar_m
    scans, clicks = [], []
    for i, place in enumerate(places):
        cart = place * (1.0 + 1.0 / np.linalg.norm(place))
        for k in range(30):
            points = np.stack([place, cart]) + 0.01 * rng.standard_normal((2, 3))
            time = TimeNs(20 * i * NS_PER_S + k * NS_PER_S // 10)
            scans.append(RadarScan(time, points, np.zeros(2), np.array([20.0, 26.0]), np.full((2, 3), np.nan)))
        clicks.append(ReflectorClick(TimeNs(20 * i * NS_PER_S + 3 * NS_PER_S // 2), f"c{i}", 100.0 * i, 50.0))
    for pair, place in zip(
        pair_clicks(clicks, RadarScans.from_scans(scans), CalibrationOptions()).pairs, places, strict=True
    ):
        assert pair.candidates[0].position_radar_m == pytest.approx(place, abs=0.03)
        assert pair.candidates[1].score > 0.3
