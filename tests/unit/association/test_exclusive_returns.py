"""No radar return belongs to two clicks of one moment."""

from dataclasses import replace
from itertools import product

import numpy as np

from calib_core.association.clustering import candidate_at
from calib_core.association.exclusive_returns import exclusive_rows, shared_returns
from calib_core.measurements import NS_PER_S, Pair, TimeNs
from calib_core.options import NoiseOptions

LEFT, RIGHT, CART = (6.0, 1.5, -1.0), (6.2, -1.0, -1.0), (9.0, 0.0, -0.5)


def pair(name: str, time_s: float | None, *positions: tuple[float, float, float]) -> Pair:
    candidates = tuple(candidate_at(np.array(position), NoiseOptions(), score=0.3) for position in positions)
    time = None if time_s is None else TimeNs(round(time_s * NS_PER_S))
    return Pair(name, np.zeros(2), candidates, image_time=time)


def first_of(pairs: list[Pair]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum([len(one.candidates) for one in pairs])])


def test_returns_are_shared_within_a_moment_whatever_their_order() -> None:
    labels = shared_returns([pair("a", 0.0, LEFT, RIGHT), pair("b", 0.2, CART, RIGHT, LEFT)], window_s=3.0)
    assert labels[0] == labels[4] >= 0
    assert labels[1] == labels[3] >= 0
    assert labels[0] != labels[1]
    assert labels[2] == -1


def test_other_moments_and_pairs_without_a_time_share_nothing() -> None:
    pairs = [pair("a", 0.0, LEFT), pair("b", 20.0, LEFT), pair("c", None, LEFT), pair("d", None, LEFT)]
    assert shared_returns(pairs, window_s=3.0).tolist() == [-1] * 4


def test_two_clicks_that_want_one_return_get_the_cheapest_assignment() -> None:
    pairs = [pair("a", 0.0, LEFT, RIGHT), pair("b", 0.2, LEFT, RIGHT)]
    labels = shared_returns(pairs, window_s=3.0)
    # both prefer the left one; it costs a less to give way
    assert exclusive_rows(np.array([1.0, 3.0, 1.0, 50.0]), first_of(pairs), labels).tolist() == [1, 2]
    assert exclusive_rows(np.array([1.0, 90.0, 1.0, 50.0]), first_of(pairs), labels).tolist() == [0, 3]


def test_without_a_conflict_every_pair_keeps_its_cheapest() -> None:
    pairs = [pair("a", 0.0, LEFT, RIGHT), pair("b", 0.2, LEFT, RIGHT), pair("c", 60.0, CART, LEFT)]
    cost = np.array([1.0, 3.0, 9.0, 5.0, 2.0, 1.0])
    assert exclusive_rows(cost, first_of(pairs), shared_returns(pairs, window_s=3.0)).tolist() == [0, 3, 5]


def test_a_pair_with_nothing_else_shares_rather_than_fails() -> None:
    pairs = [pair("a", 0.0, LEFT), pair("b", 0.2, LEFT)]
    assert exclusive_rows(np.array([1.0, 2.0]), first_of(pairs), shared_returns(pairs, window_s=3.0)).tolist() == [0, 1]
    more = [pairs[0], replace(pairs[1], candidates=(*pairs[1].candidates, *pair("x", 0.0, CART).candidates))]
    labels = shared_returns(more, window_s=3.0)
    assert exclusive_rows(np.array([1.0, 2.0, 400.0]), first_of(more), labels).tolist() == [0, 2]


def test_three_rivals_get_what_trying_everything_gives() -> None:
    pairs = [pair(name, 0.1 * k, LEFT, RIGHT, CART) for k, name in enumerate("abc")]
    labels, first = shared_returns(pairs, window_s=3.0), first_of(pairs)
    rng = np.random.default_rng(1)
    for _ in range(200):
        cost = rng.uniform(0.0, 10.0, 9)
        rows = exclusive_rows(cost, first, labels)
        assert len(set(labels[rows].tolist())) == 3
        every = [
            sum(cost[3 * i + k] for i, k in enumerate(choice))
            for choice in product(range(3), repeat=3)
            if len(set(choice)) == 3
        ]
        assert cost[rows].sum() == min(every)


def test_six_rivals_never_share() -> None:
    places = tuple((5.0 + k, 0.0, -1.0) for k in range(7))
    pairs = [pair(str(k), 0.1 * k, *places) for k in range(6)]
    labels, first = shared_returns(pairs, window_s=3.0), first_of(pairs)
    rows = exclusive_rows(np.random.default_rng(2).uniform(0.0, 9.0, 42), first, labels)
    assert len(set(labels[rows].tolist())) == 6
