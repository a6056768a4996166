"""A return that a person chose is the pair's only one, and guesses change nothing."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy.clutter import SCENES
from benchmarks.accuracy.scenes import Windows, draw_windows
from calib_core.association.pairing import pair_clicks
from calib_core.calibration import calibrate
from calib_core.measurements import NS_PER_S, ChosenReturn, Pair, RadarScans, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

OPTIONS = CalibrationOptions()
SEED = 20261122


@pytest.fixture(scope="module")
def windows() -> Windows:
    busy = max(SCENES, key=lambda scene: scene.objects)
    return draw_windows(busy, np.random.default_rng(SEED))


def position(pair: Pair, index: int) -> tuple[float, float, float]:
    x, y, z = pair.candidates[index].position_radar_m.tolist()
    return (x, y, z)


def test_a_chosen_return_is_the_only_candidate_and_the_others_are_set_aside(windows: Windows) -> None:
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


def test_a_choice_where_the_radar_saw_nothing_leaves_the_click_unpaired_and_says_where(windows: Windows) -> None:
    click = replace(windows.clicks[0], chosen=ChosenReturn((4.0, -40.0, 0.0)))
    (lone,) = pair_clicks([click], windows.scans, OPTIONS).unpaired
    assert lone.code == "chosen-return-missing"
    assert "40.2 m away and 84.3 deg to the right" in lone.reason


def test_the_other_clicks_of_a_placement_share_its_choice(windows: Windows) -> None:
    free = pair_clicks(windows.clicks, windows.scans, OPTIONS).pairs
    pair = next(pair for pair in free if len(pair.candidates) > 1)
    click = next(click for click in windows.clicks if click.id == pair.id)
    again = replace(click, id="again", image_time=TimeNs(click.image_time + NS_PER_S // 3), u_px=click.u_px + 1.0)
    chosen = replace(click, chosen=ChosenReturn(position(pair, 1)))
    found = pair_clicks([chosen, again], windows.scans, OPTIONS).pairs
    assert [len(one.candidates) for one in found] == [1, 1]
    away = replace(again, u_px=click.u_px + 60.0)
    assert len(pair_clicks([chosen, away], windows.scans, OPTIONS).pairs[1].candidates) > 1


def test_guesses_change_nothing_about_the_answer(windows: Windows) -> None:
    measured = windows.clicks[:8]
    guesses = [replace(click, mark="untouched") for click in windows.clicks[8:]]
    alone = calibrate(measured, windows.scans, windows.rig.camera, OPTIONS).unwrap()
    joined = calibrate([*measured, *guesses], windows.scans, windows.rig.camera, OPTIONS).unwrap()
    assert isinstance(alone, Calibration)
    assert isinstance(joined, Calibration)
    assert joined.camera_from_radar.translation_m.tobytes() == alone.camera_from_radar.translation_m.tobytes()
    assert joined.camera_from_radar.rotation.tobytes() == alone.camera_from_radar.rotation.tobytes()
    assert joined.covariance.tobytes() == alone.covariance.tobytes()
    assert joined.metrics == alone.metrics
    assert joined.warnings == alone.warnings
    assert sum(pair.excluded for pair in joined.pairs) == len(guesses)


def test_guesses_do_not_make_up_the_four_pairs_that_a_pose_needs(windows: Windows) -> None:
    clicks = [*windows.clicks[:3], *(replace(click, mark="untouched") for click in windows.clicks[3:])]
    outcome = calibrate(clicks, windows.scans, windows.rig.camera, OPTIONS)
    assert isinstance(outcome, Unsolvable)
    assert outcome.reason == "3 of at least 4 required pairs, 17 untouched"
    assert len(outcome.pairs) == len(clicks)


def test_algorithm_1_says_that_it_does_not_use_a_choice(windows: Windows) -> None:
    paper = CalibrationOptions(method="paper")
    free = pair_clicks(windows.clicks, windows.scans, OPTIONS).pairs
    chosen = replace(windows.clicks[0], chosen=ChosenReturn(position(free[0], 0)))
    outcome = calibrate([chosen, *windows.clicks[1:]], windows.scans, windows.rig.camera, paper)
    if isinstance(outcome, Calibration):
        assert outcome.warnings[-1].code == "choices-unused"


def test_without_clicks_there_is_nothing_to_pair() -> None:
    assert pair_clicks([], RadarScans(), OPTIONS).pairs == ()
