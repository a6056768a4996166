"""What traffic says of a turn: an honest interval, what baseline and window share cancels, no single passage decides."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from calib_core.watching.traffic import BEARING, ELEVATION, TrafficRows, learned

NS = 1_000_000_000


def traffic(
    rng: np.random.Generator,
    *,
    passages: int,
    start_s: float = 0.0,
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    label: str = "person",
    body_deg: float = 0.5,
    first: int = 0,
) -> TrafficRows:
    """Return rows of passages of ten seconds: a body point each, and noise in each second."""
    rows = []
    for passage in range(first, first + passages):
        range_m, bearing = rng.uniform(6.0, 20.0), rng.uniform(-0.5, 0.5)
        body = np.deg2rad(body_deg) * rng.normal(size=2)
        for second in range(10):
            across = np.sin(bearing + 0.02 * second), np.cos(bearing + 0.02 * second)
            for direction, design in ((BEARING, (0.0, 1.0, 0.02)), (ELEVATION, (-across[1], 0.0, across[0]))):
                value = design @ np.deg2rad(turn_deg) + body[direction] + np.deg2rad(0.3) * rng.normal()
                value += 0.03 if direction == ELEVATION else 0.02  # of the calibration itself
                time = round((start_s + 2.0 * (passage - first) + second) * NS)
                height = 1.7 / range_m if direction == ELEVATION else 0.0
                rows.append((time, direction, value, (*design, 0.0), height, range_m, 8.0, passage))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return TrafficRows(*columns, np.array([label] * len(rows), dtype=object))


def crossing(
    rng: np.random.Generator, *, late_s: float, both: bool = True, rate: float = 0.5, **given: Any
) -> TrafficRows:
    """Return rows of passages that move across the image, every other one the other way, with images that are late."""
    rows = traffic(rng, body_deg=0.2, **given)
    rates = np.where(both & (rows.passages % 2 == 0), rate, -rate) * (rows.directions == BEARING)
    design = np.concatenate([rows.design[:, :3], rates[:, None]], axis=1)
    return replace(rows, design=design, residuals_rad=rows.residuals_rad + rates * late_s)


def test_a_turn_since_the_baseline_is_found_and_what_both_share_cancels():
    errors = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        model = learned(traffic(rng, passages=40))
        turn = model.turn(traffic(rng, passages=10, start_s=600.0, turn_deg=(0.5, -0.8, 0.0), first=100))
        assert turn is not None
        assert turn.passages == 10
        error = turn.rotation_rad - np.deg2rad([0.5, -0.8, 0.0])
        errors.append(error / np.sqrt(np.diag(turn.covariance_rad2)))
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(1.0, abs=0.3)


def test_no_single_passage_and_never_fewer_than_three_decide():
    rng = np.random.default_rng(1)
    model = learned(traffic(rng, passages=40))
    window = traffic(rng, passages=6, start_s=600.0, first=100)
    stray = traffic(rng, passages=1, start_s=610.0, turn_deg=(0.0, 2.5, 0.0), body_deg=0.0, first=200)
    few = traffic(rng, passages=3, start_s=600.0, turn_deg=(0.0, 2.5, 0.0), first=100)

    with_stray = model.turn(TrafficRows.joined([window, stray]))
    of_three, of_two = model.turn(few), model.turn(few.some(few.passages < 102))

    assert with_stray is not None
    assert of_two is not None
    assert of_three is not None
    assert with_stray.least_z[1] < 3.0
    assert of_three.least_z[1] > 3.0
    assert (of_two.least_z == 0.0).all()
    assert np.isinf(of_two.worst_sigma_rad).all()


def test_a_class_that_the_baseline_lacks_widens():
    rng = np.random.default_rng(2)
    model = learned(traffic(rng, passages=40))
    known = model.turn(traffic(rng, passages=8, start_s=600.0, first=100))
    unknown = model.turn(traffic(rng, passages=8, start_s=600.0, label="truck", first=100))

    assert known is not None
    assert unknown is not None
    wider = np.sqrt(np.diag(unknown.covariance_rad2) / np.diag(known.covariance_rad2))
    assert wider[0] > 1.5
    assert 1.3 < wider[1] < 2.9


def test_seconds_of_one_passage_do_not_count_as_independent():
    rng = np.random.default_rng(3)
    model = learned(traffic(rng, passages=40))
    window = traffic(rng, passages=4, start_s=600.0, first=100)
    half = window.some(np.arange(len(window)) % 4 < 2)

    whole, part = model.turn(window), model.turn(half)

    assert whole is not None
    assert part is not None
    ratio = np.sqrt(part.covariance_rad2[1, 1] / whole.covariance_rad2[1, 1])
    assert ratio < 1.2


def test_a_change_of_the_clocks_offset_is_told_from_a_turn_where_traffic_crosses_both_ways():
    rng = np.random.default_rng(5)
    model = learned(crossing(rng, late_s=0.02, passages=60))
    later = {"passages": 20, "start_s": 600.0, "first": 100}

    turn = model.turn(crossing(rng, late_s=0.07, turn_deg=(0.0, 0.6, 0.0), **later))
    one_way = model.turn(crossing(rng, late_s=0.02, both=False, **later))

    assert turn is not None
    assert one_way is not None
    assert turn.late_s[0] == pytest.approx(0.05, abs=3.0 * turn.late_s[1])
    assert turn.late_s[1] < 0.005
    assert np.rad2deg(turn.rotation_rad[1]) == pytest.approx(0.6, abs=0.2)
    assert one_way.late_s[1] > 2.0 * turn.late_s[1]
    wider = np.sqrt(one_way.covariance_rad2[1, 1] / turn.covariance_rad2[1, 1])
    assert wider > 2.0


def test_a_wrong_match_counts_less_and_few_far_rows_do_not_widen_the_rest():
    rng = np.random.default_rng(6)
    clean = traffic(rng, passages=60)
    far = replace(clean, residuals_rad=clean.residuals_rad + np.where(clean.passages % 20 == 0, np.deg2rad(8.0), 0.0))

    without, with_far = learned(clean).turn(clean), learned(far).turn(clean)

    assert without is not None
    assert with_far is not None
    assert np.sqrt(with_far.covariance_rad2[1, 1] / without.covariance_rad2[1, 1]) < 1.4
    assert abs(np.rad2deg(with_far.rotation_rad[1])) < 0.2


def test_a_passage_that_is_far_off_pulls_a_turn_by_less_than_its_sigma():
    pulls = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        model = learned(traffic(rng, passages=60))
        window = traffic(rng, passages=12, start_s=600.0, first=100)
        astray = (window.passages == 105) & (window.directions == BEARING)
        far = replace(window, residuals_rad=window.residuals_rad + np.where(astray, np.deg2rad(4.0), 0.0))
        without, with_far = model.turn(window), model.turn(far)
        assert without is not None
        assert with_far is not None
        moved = with_far.rotation_rad[1] - without.rotation_rad[1]
        pulls.append(abs(moved) / np.sqrt(without.covariance_rad2[1, 1]))
    assert np.mean(pulls) < 0.8
