"""Every click gets radar positions, or a reason why it has none."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmarks.accuracy.clutter import SCENES
from benchmarks.accuracy.scenes import Windows, draw_windows
from benchmarks.simulated_pairs import simulate_pairs
from calib_core.association.clustering import candidate_at, candidates_of, clusters_of, window_around
from calib_core.association.exclusive_returns import exclusive_rows, shared_returns
from calib_core.association.gating import static_returns
from calib_core.association.pairing import (
    background_windows,
    balanced_pairs,
    find_companion,
    half_window_s,
    pair_clicks,
    scores_of,
)
from calib_core.calibration import calibrate
from calib_core.measurements import (
    NS_PER_S,
    ChosenReturn,
    Pair,
    RadarScan,
    RadarScans,
    ReflectorClick,
    TimeNs,
)
from calib_core.options import CalibrationOptions, GatingOptions, LocatingOptions, NoiseOptions, PaperOptions
from calib_core.results import Calibration
from tests.scans import scan_of


def scans_at(times_s: list[float], *, doppler_mps: float = 0.0) -> RadarScans:
    return RadarScans.from_scans(
        [scan_of(time_s, [[6.0, 0.5, -1.0]], doppler_mps=doppler_mps, snr_db=30.0) for time_s in times_s]
    )


def click(name: str, time_s: float) -> ReflectorClick:
    return ReflectorClick(TimeNs(round(time_s * NS_PER_S)), name, 100.0, 50.0)


def test_pairs_come_in_order_of_image_time_whatever_the_order_of_clicks():
    scans = scans_at([0.1 * k for k in range(100)])
    clicks = [click("b", 5.0), click("a", 2.0), click("c", 8.0)]
    forward, backward = (pair_clicks(order, scans, CalibrationOptions()) for order in (clicks, clicks[::-1]))
    assert [pair.id for pair in forward.pairs] == ["a", "b", "c"] == [pair.id for pair in backward.pairs]
    assert forward.pairs[0].candidates[0].position_radar_m.tobytes() == (
        backward.pairs[0].candidates[0].position_radar_m.tobytes()
    )


def test_a_click_far_from_every_scan_stays_unpaired_with_the_gap():
    pairing = pair_clicks([click("a", 12.0)], scans_at([0.0, 1.0]), CalibrationOptions())
    assert pairing.pairs == ()
    assert pairing.unpaired[0].code == "no-scan"
    assert pairing.unpaired[0].facts["gap_s"] == pytest.approx(11.0)


@pytest.mark.parametrize(("share", "pairs"), [(0.9, 1), (1.1, 0)])
def test_a_click_is_paired_with_scans_as_far_away_as_the_option_allows(share, pairs):
    options = CalibrationOptions()
    scans = scans_at([0.0, 0.5, 1.0])
    assert len(pair_clicks([click("a", 1.0 + share * options.locating.max_time_gap_s)], scans, options).pairs) == pairs


def test_a_click_among_moving_returns_stays_unpaired():
    pairing = pair_clicks([click("a", 0.5)], scans_at([0.0, 0.5, 1.0], doppler_mps=1.0), CalibrationOptions())
    assert [one.code for one in pairing.unpaired] == ["no-static-return"]


def test_a_recording_without_scans_leaves_every_click_unpaired():
    pairing = pair_clicks([click("b", 1.0), click("a", 0.5)], RadarScans(), CalibrationOptions())
    assert [(one.id, one.code) for one in pairing.unpaired] == [("a", "no-scan"), ("b", "no-scan")]


def test_a_pair_carries_the_stamp_of_the_nearest_scan():
    (pair,) = pair_clicks([click("a", 0.52)], scans_at([0.0, 0.5, 1.0]), CalibrationOptions()).pairs
    assert pair.radar_time == round(0.5 * NS_PER_S)
    assert pair.candidates[0].scans == 3


@pytest.mark.parametrize("window_s", [3.0, 8.0])
def test_the_scans_read_around_a_click_are_all_that_matter_however_far_away_the_nearest_is(window_s):
    options = replace(OPTIONS, locating=replace(OPTIONS.locating, window_s=window_s))
    for times_s in (
        np.arange(0.0, 10.05, 0.1),
        np.arange(12.9, 23.0, 0.1),
    ):  # it ends, or begins, 1.45 s from the click
        one, scans = click("a", 11.45), scans_at(times_s.tolist())
        reach_ns = round(half_window_s(options) * NS_PER_S)
        around = scans.between(TimeNs(one.image_time - reach_ns), TimeNs(one.image_time + reach_ns))
        assert len(around) < len(scans)
        (read,), (whole,) = (pair_clicks([one], some, options).pairs for some in (around, scans))
        assert read.candidates[0].scans == whole.candidates[0].scans > 5.0 * window_s


def test_clicks_of_one_placement_share_every_scan_of_their_windows():
    scans = scans_at([0.1 * k for k in range(100)])
    pairs = pair_clicks([click("a", 4.0), click("b", 5.0)], scans, CalibrationOptions()).pairs
    assert [pair.candidates[0].scans for pair in pairs] == [41, 41]  # 2.5 to 6.5 s


OPTIONS = CalibrationOptions()
SEED = 20261122


@pytest.fixture(scope="module")
def windows() -> Windows:
    busy = max(SCENES, key=lambda scene: scene.objects)
    return draw_windows(busy, np.random.default_rng(SEED))


def position(pair: Pair, index: int) -> tuple[float, float, float]:
    x, y, z = pair.candidates[index].position_radar_m.tolist()
    return (x, y, z)


def test_a_chosen_return_is_the_only_candidate_and_the_others_are_set_aside(windows):
    free = pair_clicks(windows.clicks, windows.scans, OPTIONS).pairs
    pair = next(pair for pair in free if len(pair.candidates) > 2)
    chosen = ChosenReturn(position(pair, 2))
    clicks = [replace(click, chosen=chosen) if click.id == pair.id else click for click in windows.clicks]
    found = {one.id: one for one in pair_clicks(clicks, windows.scans, OPTIONS).pairs}
    assert len(found[pair.id].candidates) == 1
    assert found[pair.id].candidates[0].position_radar_m == pytest.approx(np.array(chosen.position_m), abs=1e-9)
    assert found[pair.id].candidates[0].score == 1.0
    assert len(found[pair.id].set_aside) == len(pair.candidates)
    assert found[pair.id].chosen == chosen
    for other in free:
        if other.id != pair.id:
            assert len(found[other.id].candidates) == len(other.candidates)


def test_a_choice_where_the_radar_saw_nothing_leaves_the_click_unpaired_and_says_where(windows):
    click = replace(windows.clicks[0], chosen=ChosenReturn((4.0, -40.0, 0.0)))
    (lone,) = pair_clicks([click], windows.scans, OPTIONS).unpaired
    assert lone.code == "chosen-return-missing"
    assert lone.facts["range_m"] == pytest.approx(40.2, abs=0.05)
    assert lone.facts["azimuth_deg"] == pytest.approx(-84.3, abs=0.05)


def test_the_other_clicks_of_a_placement_share_its_choice(windows):
    free = pair_clicks(windows.clicks, windows.scans, OPTIONS).pairs
    pair = next(pair for pair in free if len(pair.candidates) > 1)
    click = next(click for click in windows.clicks if click.id == pair.id)
    again = replace(click, id="again", image_time=TimeNs(click.image_time + NS_PER_S // 3), u_px=click.u_px + 1.0)
    chosen = replace(click, chosen=ChosenReturn(position(pair, 1)))
    found = pair_clicks([chosen, again], windows.scans, OPTIONS).pairs
    assert [len(one.candidates) for one in found] == [1, 1]
    away = replace(again, u_px=click.u_px + 60.0)
    assert len(pair_clicks([chosen, away], windows.scans, OPTIONS).pairs[1].candidates) > 1


def test_guesses_change_nothing_about_the_answer(windows):
    measured = windows.clicks[:8]
    guesses = [replace(click, mark="untouched") for click in windows.clicks[8:]]
    alone = calibrate(measured, windows.scans, windows.rig.camera, OPTIONS).unwrap()
    joined = calibrate([*measured, *guesses], windows.scans, windows.rig.camera, OPTIONS).unwrap()
    assert isinstance(alone, Calibration)
    assert joined.camera_from_radar.translation_m.tobytes() == alone.camera_from_radar.translation_m.tobytes()
    assert joined.camera_from_radar.rotation.tobytes() == alone.camera_from_radar.rotation.tobytes()
    assert joined.covariance.tobytes() == alone.covariance.tobytes()
    assert joined.metrics == alone.metrics
    assert joined.warnings == alone.warnings
    assert sum(pair.excluded for pair in joined.pairs) == len(guesses)


def test_guesses_do_not_make_up_the_four_pairs_that_a_pose_needs(windows):
    clicks = [*windows.clicks[:3], *(replace(click, mark="untouched") for click in windows.clicks[3:])]
    outcome = calibrate(clicks, windows.scans, windows.rig.camera, OPTIONS)
    assert outcome.facts == {"used": 3, "needed": 4, "excluded": 0, "unpaired": 0, "untouched": 17}
    assert len(outcome.pairs) == len(clicks)


@pytest.mark.parametrize(("region_m", "code"), [(1.0, "placement-ranges"), (0.0, "choices-unused")])
def test_algorithm_1_says_whether_it_uses_a_choice(windows, region_m, code):
    paper = CalibrationOptions(method="paper", paper=PaperOptions(region_m=region_m))
    free = pair_clicks(windows.clicks, windows.scans, OPTIONS).pairs
    chosen = replace(windows.clicks[0], chosen=ChosenReturn(position(free[0], 0)))
    outcome = calibrate([chosen, *windows.clicks[1:]], windows.scans, windows.rig.camera, paper)
    if isinstance(outcome, Calibration):
        assert outcome.warnings[-1].code == code


def test_without_clicks_there_is_nothing_to_pair():
    assert pair_clicks([], RadarScans(), OPTIONS).pairs == ()


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


def test_the_cart_behind_every_placement_is_found_with_its_distance():
    companion = find_companion(with_second(np.full(12, 1.0), score=0.6))
    assert companion.offset_m == pytest.approx(1.0, abs=0.05)
    assert companion.near.tolist() == [1] * 12
    assert companion.far.tolist() == [0] * 12


def test_reflector_and_cart_get_nearly_the_same_score_and_keep_their_sum():
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
def test_what_is_no_companion_changes_no_score(pairs):
    assert find_companion(pairs) is None
    assert all(after is before for after, before in zip(balanced_pairs(pairs), pairs, strict=True))


def test_pairs_without_the_cart_are_left_alone():
    pairs = with_second(np.full(12, 1.0), score=0.6)
    pairs[4] = replace(pairs[4], candidates=pairs[4].candidates[1:])
    companion = find_companion(pairs)
    assert companion.near[4] == companion.far[4] == -1
    assert balanced_pairs(pairs)[4] is pairs[4]


def test_clicks_of_a_reflector_in_front_of_a_cart_prefer_the_reflector():
    rng = np.random.default_rng(2)
    places = simulate_pairs(8, rng=rng).points_radar_m
    scans, clicks = [], []
    for i, place in enumerate(places):
        cart = place * (1.0 + 1.0 / np.linalg.norm(place))
        for k in range(30):
            points = np.stack([place, cart]) + 0.01 * rng.standard_normal((2, 3))
            scans.append(scan_of(20 * i + k / 10, points, snr_db=[20.0, 26.0]))
        clicks.append(ReflectorClick(TimeNs(20 * i * NS_PER_S + 3 * NS_PER_S // 2), f"c{i}", 100.0 * i, 50.0))
    for pair, place in zip(
        pair_clicks(clicks, RadarScans.from_scans(scans), CalibrationOptions()).pairs, places, strict=True
    ):
        assert pair.candidates[0].position_radar_m == pytest.approx(place, abs=0.03)
        assert pair.candidates[1].score > 0.3


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
        scans.append(scan_of(k / 10, points, snr_db=snr))
    return RadarScans.from_scans(scans)


def click_at(placement: int) -> ReflectorClick:
    return ReflectorClick(TimeNs((15 * placement + 8) * NS_PER_S), f"c{placement}", 100.0 * placement, 50.0)


def test_what_other_windows_show_too_is_no_candidate():
    scans = recording()
    windows = [window_around(scans, click_at(i).image_time, window_s=3.0) for i in range(8)]
    clusters = [clusters_of(window, most=12) for window in windows]
    for place, found, scores in zip(PLACES, clusters, scores_of(windows, clusters), strict=True):
        (only,) = candidates_of(found, scores, LocatingOptions(), NoiseOptions())
        assert only.position_radar_m == pytest.approx(place, abs=0.02)


def test_one_click_is_enough_where_the_rest_of_the_recording_shows_the_background():
    (pair,) = pair_clicks([click_at(3)], recording(), CalibrationOptions(), background=recording()).pairs
    assert pair.candidates[0].position_radar_m == pytest.approx(PLACES[3], abs=0.02)
    assert pair.candidates[0].score > 0.95


def test_background_windows_are_clear_of_every_click_and_few():
    scans = recording()
    windows = [window_around(scans, click_at(i).image_time, window_s=3.0) for i in (1, 5)]
    background = background_windows(scans, windows, window_s=3.0)
    assert 8 < len(background) <= 16
    for empty in background:
        for window in windows:
            assert empty.times_ns[0] > window.times_ns[-1] or empty.times_ns[-1] < window.times_ns[0]


def test_scans_around_the_clicks_alone_have_no_background_windows():
    around = recording().between(TimeNs(19 * NS_PER_S), TimeNs(27 * NS_PER_S))
    window = window_around(around, click_at(1).image_time, window_s=3.0)
    assert background_windows(around, [window], window_s=3.0) == ()
    assert background_windows(RadarScans(), [], window_s=3.0) == ()


def test_in_a_busy_window_more_candidates_are_kept_than_in_a_clear_one():
    clear = np.array([0.97, 0.02, 0.005, 0.005])
    busy = np.full(30, 1.0 / 30.0)
    found = clusters_of(recording().between(TimeNs(0), TimeNs(3 * NS_PER_S)), most=1)
    for scores, kept in ((clear, 2), (busy, 16)):
        clusters = found * len(scores)
        assert len(candidates_of(clusters, scores, LocatingOptions(), NoiseOptions())) == kept


# Static returns in range are kept, all others dropped, and the stamps stay the same.


NAN = float("nan")


def scan(time: int, rows: list[tuple[float, float, float, float]]) -> RadarScan:
    """Rows are x, y, z, Doppler."""
    table = np.array(rows).reshape(-1, 4)
    return scan_of(1e-9 * time, table[:, :3], doppler_mps=table[:, 3], snr_db=np.arange(len(table)))


def test_a_moving_return_is_dropped():
    scans = RadarScans.from_scans([scan(1, [(5, 0, 0, 0.0), (5, 1, 0, 0.2), (5, 2, 0, -0.2), (5, 3, 0, 0.05)])])
    kept = static_returns(scans, GatingOptions(max_speed_mps=0.05))
    assert kept.points_radar_m[:, 1].tolist() == [0.0, 3.0]
    assert kept.snr_db.tolist() == [0.0, 3.0]


def test_a_return_without_doppler_is_kept():
    kept = static_returns(RadarScans.from_scans([scan(1, [(5, 0, 0, NAN)])]), GatingOptions())
    assert len(kept.points_radar_m) == 1


@pytest.mark.parametrize("point", [(0.1, 0.0, 0.0), (80.0, 0.0, 0.0), (NAN, 0.0, 0.0), (5.0, 0.0, NAN)])
def test_a_return_out_of_range_or_without_position_is_dropped(point):
    kept = static_returns(RadarScans.from_scans([scan(1, [(*point, 0.0), (5, 0, 0, 0.0)])]), GatingOptions())
    assert kept.points_radar_m.tolist() == [[5.0, 0.0, 0.0]]


def test_every_scan_is_kept_even_if_it_becomes_empty():
    scans = RadarScans.from_scans([scan(1, [(5, 0, 0, 1.0)]), scan(2, [(5, 0, 0, 0.0)]), scan(3, [])])
    kept = static_returns(scans, GatingOptions())
    assert kept.times_ns.tolist() == [1, 2, 3]
    assert [len(kept.scan(i)) for i in range(3)] == [0, 1, 0]


# No radar return belongs to two clicks of one moment.


LEFT, RIGHT, CART = (6.0, 1.5, -1.0), (6.2, -1.0, -1.0), (9.0, 0.0, -0.5)


def pair(name: str, time_s: float | None, *positions: tuple[float, float, float]) -> Pair:
    candidates = tuple(candidate_at(np.array(position), NoiseOptions(), score=0.3) for position in positions)
    time = None if time_s is None else TimeNs(round(time_s * NS_PER_S))
    return Pair(name, np.zeros(2), candidates, image_time=time)


def first_of(pairs: list[Pair]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum([len(one.candidates) for one in pairs])])


def test_returns_are_shared_within_a_moment_whatever_their_order():
    labels = shared_returns([pair("a", 0.0, LEFT, RIGHT), pair("b", 0.2, CART, RIGHT, LEFT)], window_s=3.0)
    assert labels[0] == labels[4] >= 0
    assert labels[1] == labels[3] >= 0
    assert labels[0] != labels[1]
    assert labels[2] == -1


def test_other_moments_and_pairs_without_a_time_share_nothing():
    pairs = [pair("a", 0.0, LEFT), pair("b", 20.0, LEFT), pair("c", None, LEFT), pair("d", None, LEFT)]
    assert shared_returns(pairs, window_s=3.0).tolist() == [-1] * 4


def test_a_return_that_stands_in_one_place_is_shared_for_as_long_as_a_scene_lasts():
    moved = (6.02, 1.5, -1.0)
    pairs = [pair("a", 0.0, LEFT, RIGHT), pair("b", 8.0, CART, moved), pair("c", 16.0, (6.1, 1.5, -1.0))]
    labels = shared_returns(pairs, window_s=3.0)
    assert labels[0] == labels[3] >= 0
    assert labels[[1, 2, 4]].tolist() == [-1, -1, -1]  # the last one is as far away as another placement would be


def test_two_clicks_that_want_one_return_get_the_cheapest_assignment():
    pairs = [pair("a", 0.0, LEFT, RIGHT), pair("b", 0.2, LEFT, RIGHT)]
    labels = shared_returns(pairs, window_s=3.0)
    # both prefer the left one; it costs a less to give way
    assert exclusive_rows(np.array([1.0, 3.0, 1.0, 50.0]), first_of(pairs), labels).tolist() == [1, 2]
    assert exclusive_rows(np.array([1.0, 90.0, 1.0, 50.0]), first_of(pairs), labels).tolist() == [0, 3]


def test_without_a_conflict_every_pair_keeps_its_cheapest():
    pairs = [pair("a", 0.0, LEFT, RIGHT), pair("b", 0.2, LEFT, RIGHT), pair("c", 60.0, CART, LEFT)]
    cost = np.array([1.0, 3.0, 9.0, 5.0, 2.0, 1.0])
    assert exclusive_rows(cost, first_of(pairs), shared_returns(pairs, window_s=3.0)).tolist() == [0, 3, 5]


def test_a_pair_with_nothing_else_shares_rather_than_fails():
    pairs = [pair("a", 0.0, LEFT), pair("b", 0.2, LEFT)]
    assert exclusive_rows(np.array([1.0, 2.0]), first_of(pairs), shared_returns(pairs, window_s=3.0)).tolist() == [0, 1]
    more = [pairs[0], replace(pairs[1], candidates=(*pairs[1].candidates, *pair("x", 0.0, CART).candidates))]
    labels = shared_returns(more, window_s=3.0)
    assert exclusive_rows(np.array([1.0, 2.0, 400.0]), first_of(more), labels).tolist() == [0, 2]


def test_three_rivals_get_what_trying_everything_gives():
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


def test_six_rivals_never_share():
    places = tuple((5.0 + k, 0.0, -1.0) for k in range(7))
    pairs = [pair(str(k), 0.1 * k, *places) for k in range(6)]
    labels, first = shared_returns(pairs, window_s=3.0), first_of(pairs)
    rows = exclusive_rows(np.random.default_rng(2).uniform(0.0, 9.0, 42), first, labels)
    assert len(set(labels[rows].tolist())) == 6
