"""Placement detection from the radar alone."""

import json
from itertools import pairwise

import numpy as np
import pytest

from calib_core.association.placements import FirmSpan, Placement, find_placements, firm_span
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs, time_from_parts
from calib_core.options import GatingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.recordings import open_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
from calib_core.synthetic.scene.stage import SimulatedPlacement
from tests.scans import scan_of

REFLECTOR = (6.0, 1.0, -0.8)
RATE_HZ = 10.0
COLUMNS = ("points_radar_m", "doppler_mps", "snr_db", "sigma_polar")


def scans_with(
    dwells: list[tuple[float, float, tuple[float, float, float], float]], *, length_s: float = 60.0, seed: int = 0
) -> RadarScans:
    """Build scans that show objects (start [s], end [s], position [m], SNR [dB]) nine times out of ten."""
    rng = np.random.default_rng(seed)
    scans = []
    for time_s in np.arange(0.0, length_s, 1.0 / RATE_HZ):
        there = [dwell for dwell in dwells if dwell[0] <= time_s <= dwell[1] and rng.uniform() < 0.9]
        points = np.array([dwell[2] for dwell in there]).reshape(-1, 3)
        noisy = points + 0.01 * rng.standard_normal(points.shape)
        snr = np.array([dwell[3] for dwell in there]) + rng.standard_normal(len(there))
        scans.append(scan_of(float(time_s), noisy, snr_db=snr))
    return RadarScans.from_scans(scans)


def found_in(*dwells: tuple[float, float, tuple[float, float, float], float]) -> tuple[Placement, ...]:
    return find_placements(scans_with(list(dwells)), GatingOptions())


def is_of(placement: Placement, truth: SimulatedPlacement) -> bool:
    return rests_at(placement, truth.start, truth.end, truth.position_radar_m)


def rests_at(placement: Placement, start: TimeNs, end: TimeNs, position_radar_m: np.ndarray) -> bool:
    overlap = min(placement.end, end) - max(placement.start, start)
    apart_m = float(np.linalg.norm(placement.position_radar_m - position_radar_m))
    return overlap > 0.5 * (end - start) and apart_m < 0.06 + 0.06 * float(np.linalg.norm(position_radar_m))


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        SimulationOptions(scene="field", radar="imaging", clutter="heavy", seed=12),
        SimulationOptions(scene="aisle", clutter="heavy", placements=12, seed=13),
        SimulationOptions(scene="checkerboard", radar="imaging", dwell_s=3.5, seed=14),
    ],
    ids=["field-imaging-heavy", "aisle-heavy", "checkerboard-short"],
)
def test_nearly_all_simulated_placements_are_found_and_nearly_nothing_else(options):
    simulated = simulate(options)
    found = find_placements(simulated.scans, GatingOptions())
    hits = sum(any(is_of(placement, truth) for placement in found) for truth in simulated.placements)
    assert hits >= 0.95 * len(simulated.placements) - 0.5
    assert len(found) - hits <= 1
    assert list(found) == sorted(found, key=lambda placement: placement.start)
    assert all(0.0 < placement.score <= 1.0 for placement in found)


def test_all_placements_of_the_sample_recording_are_found_and_nothing_else(project_root):
    folder = project_root / "sample_data" / "rooftop"
    with open_recording([folder / "camera.bag", folder / "radar.bag"]) as recording:
        found = find_placements(recording.radar_scans(), GatingOptions())
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["placements"]
    assert len(found) == len(truth)
    for placement, true in zip(found, truth, strict=True):
        start, end = (time_from_parts(**true[key]) for key in ("start", "end"))
        assert rests_at(placement, start, end, np.array(true["position_radar_m"]))


def test_a_dwell_is_found_with_its_times_and_its_place():
    (placement,) = found_in((20.0, 27.0, REFLECTOR, 25.0))
    assert placement.start / NS_PER_S == pytest.approx(20.0, abs=0.5)
    assert placement.end / NS_PER_S == pytest.approx(27.0, abs=0.5)
    np.testing.assert_allclose(placement.position_radar_m, REFLECTOR, atol=0.01)
    assert placement.snr_db == pytest.approx(25.0, abs=0.5)
    assert placement.fading_db == pytest.approx(1.0, abs=0.3)


def test_what_is_always_there_is_clutter():
    assert found_in((0.0, 60.0, REFLECTOR, 40.0)) == ()


def test_a_blinking_return_is_not_a_placement():
    blinks = [(float(start), start + 2.5, REFLECTOR, 25.0) for start in range(0, 60, 5)]
    assert found_in(*blinks) == ()


def test_a_short_stop_is_not_a_placement():
    assert found_in((20.0, 21.5, REFLECTOR, 25.0)) == ()


def test_of_two_simultaneous_objects_the_stronger_is_the_reflector():
    person = (21.0, 26.0, (6.5, -0.5, 0.2), 12.0)
    (placement,) = found_in((20.0, 27.0, REFLECTOR, 25.0), person)
    np.testing.assert_allclose(placement.position_radar_m, REFLECTOR, atol=0.02)


def in_turn(count: int, *, snr_db: float = 25.0) -> list[tuple[float, float, tuple[float, float, float], float]]:
    """Two reflectors that are moved in turn every six seconds: each stays for twelve."""
    return [(6.0 * i + 2.0, 6.0 * i + 13.5, (6.0 + 0.4 * i, 1.5 - 0.5 * i, -0.8), snr_db) for i in range(count)]


def test_two_reflectors_moved_in_turn_are_all_found_and_nothing_else():
    truth = in_turn(8)
    ghosts = [(start, end, (x + 1.5, y, z), 12.0) for start, end, (x, y, z), _ in truth]
    person = [(start + 3.0, start + 6.0, (x - 0.5, y + 1.0, z), 11.0) for start, _, (x, y, z), _ in truth]
    found = found_in(*truth, *ghosts, *person)
    assert len(found) == 8
    for placement, (start, end, position, _) in zip(found, truth, strict=True):
        assert (placement.start / NS_PER_S, placement.end / NS_PER_S) == pytest.approx((start, end), abs=0.7)
        np.testing.assert_allclose(placement.position_radar_m, position, atol=0.02)


def test_what_comes_and_goes_with_something_stronger_belongs_to_it():
    placements = found_in((20.0, 27.0, REFLECTOR, 25.0), (20.0, 27.0, (7.2, 1.2, -0.8), 22.0))
    assert [placement.position_radar_m[0] < 6.5 for placement in placements] == [True]


@pytest.mark.parametrize(("other", "count"), [((8.0, -2.0, -0.8), 2), ((12.0, -2.0, -1.6), 2), ((12.0, 2.0, -1.6), 1)])
def test_two_reflectors_that_fill_a_piece_are_two_placements_and_a_second_echo_is_none(other, count):
    both = scans_with([(0.0, 100.0, REFLECTOR, 25.0), (0.0, 100.0, other, 20.0)], length_s=5.0)
    nothing = scans_with([], length_s=60.0)
    later = RadarScans(
        nothing.times_ns + 100 * NS_PER_S, nothing.first_return, *(getattr(nothing, name) for name in COLUMNS)
    )
    pieces = RadarScans.from_scans([part.scan(i) for part in (both, later) for i in range(len(part))])
    placements = find_placements(pieces, GatingOptions())
    assert len(placements) == count
    assert min(abs(one.position_radar_m[0] - REFLECTOR[0]) for one in placements) < 0.1


def test_bags_of_one_placement_each_are_placements_however_long_one_is():
    scans, ends_s = [], (0.0, 60.0, 82.0, 104.0)
    wall = (15.0, 4.0, -0.5)
    for before_s, end_s, place in zip(
        ends_s, ends_s[1:], ((6.0, 1.0, -0.8), (9.0, -2.0, -0.8), (12.0, 3.0, -0.8)), strict=False
    ):
        start_s = before_s + 10.0 if before_s else 0.0
        bag = scans_with([(start_s, end_s, place, 29.0), (start_s, end_s, wall, 25.0)], length_s=end_s)
        scans += [bag.scan(i) for i in np.flatnonzero(bag.times_ns >= start_s * NS_PER_S)]
    found = find_placements(RadarScans.from_scans(scans), GatingOptions())
    assert [round(float(one.position_radar_m[0])) for one in found] == [6, 9, 12]


def test_a_dwell_that_somebody_hides_for_a_moment_is_one_placement():
    (placement,) = found_in((10.0, 15.0, REFLECTOR, 25.0), (17.0, 23.0, REFLECTOR, 25.0))
    assert (placement.start / NS_PER_S, placement.end / NS_PER_S) == pytest.approx((10.0, 23.0), abs=0.5)


def test_without_snr_only_one_placement_stands_at_a_time():
    scans = scans_with(in_turn(6))
    silent = RadarScans(
        scans.times_ns,
        scans.first_return,
        scans.points_radar_m,
        scans.doppler_mps,
        np.full(len(scans.snr_db), np.nan),
        scans.sigma_polar,
    )
    found = find_placements(silent, GatingOptions())
    assert all(one.end <= other.start + NS_PER_S for one, other in pairwise(found))


def scans_of_two_types(
    alternatives: dict[int, tuple[tuple[float, float, float], ...]], *, start_s: float = 20.0, end_s: float = 28.0
) -> RadarScans:
    """Build scans of which every second lists a return at the first places, the others at the second; 60 s, 10 a second."""
    scans = []
    for number, time_s in enumerate(np.arange(0.0, 60.0, 0.1).tolist()):
        places = np.array(alternatives[number % 2]) if start_s <= time_s <= end_s else np.zeros((0, 3))
        scans.append(scan_of(time_s, places, snr_db=20.0, alternative_of=np.zeros(len(places), dtype=np.int64)))
    return RadarScans.from_scans(scans)


def test_of_several_azimuths_the_one_in_both_types_of_scan_is_the_true_one():
    wrong, other = (6.0, -2.0, 0.0), (5.0, 3.5, 0.0)
    scans = scans_of_two_types({0: (wrong, REFLECTOR), 1: (REFLECTOR, other)})
    (placement,) = find_placements(scans, GatingOptions())
    assert placement.position_radar_m == pytest.approx(REFLECTOR)
    assert not len(placement.others_radar_m)


def test_azimuths_that_are_shown_as_often_are_positions_of_one_placement_the_one_listed_first_in_front():
    second = (6.0, -2.0, -0.8)
    shown = scans_of_two_types({0: (REFLECTOR, second), 1: (REFLECTOR, second)})
    (placement,) = find_placements(shown, GatingOptions())
    assert placement.position_radar_m == pytest.approx(REFLECTOR)
    assert placement.others_radar_m == pytest.approx(np.array([second]))
    first, other = placement.at_each
    assert other.position_radar_m == pytest.approx(second)
    assert first.likely > other.likely > 0.0
    assert first.likely + other.likely == pytest.approx(1.0)


def test_the_azimuth_listed_first_is_taken_where_clutter_hides_it_at_other_times():
    second = (6.0, -2.0, -0.8)
    shown = scans_of_two_types({0: (REFLECTOR, second), 1: (REFLECTOR, second)})
    clutter = scans_with([(0.0, 19.0, REFLECTOR, 20.0), (29.0, 60.0, REFLECTOR, 20.0)])
    pairs = [(shown.scan(i), clutter.scan(i)) for i in range(len(shown))]
    scans = RadarScans.from_scans([one if len(one.points_radar_m) else other for one, other in pairs])
    (placement,) = find_placements(scans, GatingOptions())
    assert placement.position_radar_m == pytest.approx(REFLECTOR, abs=0.02)


def test_an_azimuth_that_takes_turns_with_another_does_not_say_how_long_the_one_listed_first_stands():
    """The one listed first is no dwell of its own, nor is the second alternative: clutter hides them at other times."""
    early, late = (6.0, -2.0, -0.8), (5.0, 3.5, -0.8)
    parts = [
        scans_of_two_types({0: (REFLECTOR, early), 1: (REFLECTOR, early)}, start_s=20.0, end_s=25.0),
        scans_of_two_types({0: (REFLECTOR, late), 1: (REFLECTOR, late)}, start_s=25.1, end_s=30.0),
        scans_with([(a, b, place, 20.0) for a, b in ((0.0, 19.0), (31.0, 60.0)) for place in (REFLECTOR, late)]),
    ]
    scans = [max((part.scan(i) for part in parts), key=lambda scan: len(scan.points_radar_m)) for i in range(600)]
    (placement,) = find_placements(RadarScans.from_scans(scans), GatingOptions())
    assert placement.position_radar_m == pytest.approx(REFLECTOR, abs=0.02)
    assert (placement.start / NS_PER_S, placement.end / NS_PER_S) == pytest.approx((20.0, 30.0), abs=0.3)


@pytest.mark.parametrize(("clutter_db", "seen"), [(8.0, True), (18.0, False)])
def test_what_is_much_weaker_at_other_times_hides_no_placement(clutter_db, seen):
    placements = found_in((10.0, 20.0, REFLECTOR, 24.0), (42.0, 60.0, REFLECTOR, clutter_db))
    assert any(one.end < 25 * NS_PER_S for one in placements) == seen


def test_a_radar_that_scatters_widely_shows_its_placements_too():
    fine = scans_with([(5.0 + 12.0 * i, 13.0 + 12.0 * i, (6.0 + i, 1.0 - i, -0.8), 25.0) for i in range(4)])
    rng = np.random.default_rng(3)
    polar = polar_from_cartesian(fine.points_radar_m)
    polar += rng.standard_normal(polar.shape) * [0.15, np.deg2rad(1.5), np.deg2rad(3.0)]
    rough = RadarScans(
        fine.times_ns, fine.first_return, cartesian_from_polar(polar), *(getattr(fine, name) for name in COLUMNS[1:])
    )
    assert len(find_placements(rough, GatingOptions())) == 4


def test_strength_is_corrected_for_range_so_that_a_far_reflector_counts():
    near = (5.0, 10.0, (3.0, 0.0, -0.8), 40.0)
    far = (20.0, 25.0, (12.0, 1.0, -0.8), 40.0 - 40.0 * float(np.log10(12.0 / 3.0)))
    assert len(found_in(near, far)) == 2


def test_something_much_weaker_than_the_placements_is_left_out():
    dwells = [(5.0 + 10.0 * i, 10.0 + 10.0 * i, (4.0 + i, 0.0, -0.8), 30.0) for i in range(4)]
    weak = (47.0, 52.0, (6.0, 2.0, 0.0), 8.0)
    assert len(found_in(*dwells)) == 4
    assert len(found_in(*dwells, weak)) == 4


def test_a_return_between_two_cells_is_one_placement():
    # range 6.00 m lies on a border of the 8 cm cells, azimuth 0 on one of the angle cells
    (placement,) = found_in((20.0, 27.0, (6.0, 0.0, 0.0), 25.0))
    assert (placement.end - placement.start) / NS_PER_S > 6.0


def test_moving_returns_and_returns_without_position_are_ignored():
    scans = scans_with([(20.0, 27.0, REFLECTOR, 25.0)])
    columns = {
        "times_ns": scans.times_ns,
        "first_return": scans.first_return,
        "snr_db": scans.snr_db,
        "sigma_polar": scans.sigma_polar,
    }
    moving = RadarScans(**columns, points_radar_m=scans.points_radar_m, doppler_mps=np.full(len(scans.snr_db), 0.4))
    nowhere = RadarScans(**columns, points_radar_m=scans.points_radar_m * np.nan, doppler_mps=scans.doppler_mps)
    assert find_placements(moving, GatingOptions()) == ()
    assert find_placements(nowhere, GatingOptions()) == ()


def test_two_levels_in_turn_are_no_fading_and_rayleighs_are():
    scans = scans_with([(10.0, 30.0, REFLECTOR, 25.0)])
    scan = scans.scan_of_return()
    amplitudes = np.random.default_rng(1).rayleigh(size=len(scans))
    for level_db, least, most in ((8.0 * (scan % 2), 0.7, 1.3), (20.0 * np.log10(amplitudes[scan]), 4.5, 7.0)):
        columns = {name: getattr(scans, name) for name in ("times_ns", "first_return", "doppler_mps", "sigma_polar")}
        levelled = RadarScans(**columns, points_radar_m=scans.points_radar_m, snr_db=scans.snr_db + level_db)
        (placement,) = find_placements(levelled, GatingOptions())
        assert least < placement.fading_db < most


def test_a_radar_without_snr_and_doppler_still_shows_placements():
    scans = scans_with([(20.0, 27.0, REFLECTOR, float("nan"))])
    silent = RadarScans(
        times_ns=scans.times_ns,
        first_return=scans.first_return,
        points_radar_m=scans.points_radar_m,
        doppler_mps=np.full(len(scans.snr_db), np.nan),
        snr_db=scans.snr_db,
        sigma_polar=scans.sigma_polar,
    )
    (placement,) = find_placements(silent, GatingOptions())
    assert np.isnan(placement.snr_db)
    assert np.isnan(placement.fading_db)
    assert placement.score > 0.5


def test_no_scans_contain_no_placements():
    assert find_placements(RadarScans(), GatingOptions()) == ()


TIMES_S = np.arange(0.0, 6.0, 0.1)


def test_weak_echoes_at_both_ends_are_left_out():
    snr_db = np.full(60, 30.0)
    snr_db[:3], snr_db[-4:] = 15.0, 17.0
    assert firm_span(TIMES_S, snr_db) == FirmSpan(3, 55)


def test_a_single_strong_scan_after_a_gap_is_no_end():
    snr_db = np.full(60, 30.0)
    snr_db[-8:-1] = np.nan
    assert firm_span(TIMES_S, snr_db) == FirmSpan(0, 51)


def test_an_echo_that_varies_keeps_its_ends():
    snr_db = 30.0 + 5.0 * np.random.default_rng(1).standard_normal(60)
    snr_db[[0, -1]] = 22.0
    assert firm_span(TIMES_S, snr_db) == FirmSpan(0, 59)


def test_nothing_is_left_out_without_strengths_or_where_an_echo_changes_for_long():
    assert firm_span(TIMES_S, np.full(60, np.nan)) == FirmSpan(0, 59)
    half = np.where(np.arange(60) < 25, 30.0, 12.0)
    assert firm_span(TIMES_S, half[::-1]).first == 0
    assert firm_span(TIMES_S[:2], np.array([30.0, 10.0])) == FirmSpan(0, 1)
