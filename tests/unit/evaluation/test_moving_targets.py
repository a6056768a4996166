"""Moving targets are found by Doppler, or by how far they travel, and followed without any calibration."""

import dataclasses

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.evaluation.moving_returns import TargetOptions
from calib_core.evaluation.target_tracking import find_targets
from calib_core.measurements import RadarScans, TimeNs
from tests.scans import scan_of
from tests.street import Street, street


def scans_of(points_of, doppler_of, count: int = 30) -> RadarScans:
    """Return scans at 10 Hz whose returns are functions of the seconds."""
    scans = []
    for step in range(count):
        scans.append(scan_of(0.1 * step, points_of(0.1 * step), doppler_mps=doppler_of(0.1 * step)))
    return RadarScans.from_scans(scans)


def purity(scene: Street, targets) -> float:
    """Return the share of followed returns that come from the object most of their target comes from."""
    who = np.array([name for scan in scene.labels.scans for name in scan.tracks])
    own = [np.unique(who[target.rows], return_counts=True)[1].max() for target in targets]
    return sum(own) / sum(len(target.rows) for target in targets)


def test_one_walker_is_one_target_and_what_stands_still_is_none():
    scans = scans_of(lambda s: [(10 + s, 1, 0), (10 + s, 1.3, 0), (20, 3, 0)], lambda s: [1.0, 1.0, 0.0])
    (target,) = find_targets([scans]).tracks

    assert target.rows.tolist() == [row for row in range(90) if row % 3 < 2]
    assert target.scans.tolist() == list(range(30))
    assert np.allclose(target.positions_m[-1], [12.9, 1.15, 0.0])
    assert np.array_equal(target.points_radar_m, scans.points_radar_m[target.rows])


def test_two_walkers_apart_are_two_targets_with_ids_of_their_own():
    scans = scans_of(lambda s: [(10 + s, 4, 0), (10 + s, -4, 0)], lambda s: [1.0, 1.0])
    targets = find_targets([scans]).tracks

    assert [target.id for target in targets] == ["target-1", "target-2"]
    assert [set((target.rows % 2).tolist()) for target in targets] == [{0}, {1}]


@pytest.mark.parametrize(("seen_again_s", "count"), [(1.5, 1), (2.5, 2)])
def test_a_target_that_is_unseen_for_long_ends_and_another_is_born(seen_again_s, count):
    def seen(s):
        return not 1.0 <= s < seen_again_s

    scans = scans_of(lambda s: [(10 + s, 0, 0)] * seen(s), lambda s: [1.0] * seen(s), 40)
    assert len(find_targets([scans]).tracks) == count


def test_what_is_seen_twice_is_no_target():
    scans = scans_of(lambda s: [(10, 0, 0)] if s < 0.15 else [], lambda s: [1.0] if s < 0.15 else [])
    assert find_targets([scans]).tracks == ()


def test_clusters_reach_as_far_as_the_radars_noise():
    def points(s: float) -> list[tuple[float, float, float]]:
        return [(40 + s, 1.0, 0), (40 + s, 3.0, 0)]

    coarse, fine = (
        len(find_targets([scans_of(points, lambda s: [1.0, 1.0])], TargetOptions(sigma_azimuth_deg=sigma)).tracks)
        for sigma in (2.0, 0.1)
    )
    assert (coarse, fine) == (1, 2)


def test_people_are_followed_without_being_mixed_up():
    scene = street(people=3, seconds=20.0)
    assert purity(scene, find_targets([scene.scans]).tracks) > 0.95


def test_from_moving_sensors_only_what_moves_over_ground_is_found():
    scene = street(people=2, seconds=10.0, ego_mps=(8.0, 0.5))
    found = find_targets([scene.scans])
    who = np.array([name for scan in scene.labels.scans for name in scan.tracks])

    assert found.moving.sensors_moved
    followed = np.concatenate([target.rows for target in found.tracks])
    assert (who[followed] != "").mean() > 0.98
    assert len(followed) > 0.95 * (who != "").sum()


def test_a_near_car_with_most_of_the_returns_is_no_moving_ground():
    rng = np.random.default_rng(1)
    car = np.stack([rng.uniform(0, 4, 20), rng.uniform(-0.9, 0.9, 20), np.zeros(20)], axis=1)
    still = np.array([[5.0, 6, 0], [15, -9, 0], [22, 3, 0], [30, 10, 0], [18, 12, 0]])

    def points(s: float) -> np.ndarray:
        return np.concatenate([car + np.array([6 + 2 * s, 2, 0]), still])

    def doppler(s: float) -> np.ndarray:
        place = points(s)[:20]
        return np.concatenate([2.0 * place[:, 0] / np.linalg.norm(place, axis=1), np.zeros(5)])

    found = find_targets([scans_of(points, doppler)])
    assert not found.moving.sensors_moved
    assert set(np.concatenate([target.rows for target in found.tracks]) % 25) == set(range(20))


@pytest.mark.slow
def test_without_doppler_targets_are_what_travels():
    scene = street(people=2, seconds=20.0, with_doppler=False)
    found = find_targets([scene.scans])
    who = np.array([name for scan in scene.labels.scans for name in scan.tracks])

    assert [warning.code for warning in found.moving.warnings] == ["no-doppler"]
    assert (who[np.concatenate([target.rows for target in found.tracks])] != "").mean() > 0.85


def test_without_doppler_moving_sensors_cannot_be_told_from_moving_targets():
    scene = street(people=1, seconds=2.0, with_doppler=False)
    with pytest.raises(InputError, match="no Doppler speeds"):
        find_targets([scene.scans], TargetOptions(sensors="moving"))


def test_pieces_of_a_recording_give_the_same_targets_as_the_whole():
    scene = street(people=3, seconds=10.0)
    whole = scene.scans
    cut = TimeNs(int(whole.times_ns[47]))
    pieces = [whole.between(TimeNs(0), TimeNs(cut - 1)), whole.between(cut, TimeNs(int(whole.times_ns[-1])))]
    told: list[tuple[int, int]] = []
    found = find_targets(pieces, progress=lambda done, total: told.append((done, total)))

    assert [target.rows.tolist() for target in found.tracks] == [
        target.rows.tolist() for target in find_targets([whole]).tracks
    ]
    assert told[0] == (0, 100)


def test_of_alternative_positions_of_one_return_the_first_counts():
    scans = scans_of(lambda s: [(10 + s, 0, 0), (10 + s, 6, 0)], lambda s: [1.0, 1.0])
    doubled = dataclasses.replace(scans, alternative_of=np.zeros(60, dtype=np.int64))
    (target,) = find_targets([doubled]).tracks
    assert set((target.rows % 2).tolist()) == {0}


def test_positions_that_are_not_numbers_are_left_out():
    scans = scans_of(lambda s: [(10 + s, 0, 0), (np.nan, 0, 0)], lambda s: [1.0, 1.0])
    (target,) = find_targets([scans]).tracks
    assert len(target.rows) == 30
    assert find_targets([RadarScans()]).tracks == ()
