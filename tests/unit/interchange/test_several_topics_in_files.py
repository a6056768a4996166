"""What the files say about a radar with several topics."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs, solve_again
from calib_core.errors import InputError
from calib_core.interchange import Provenance, calibration_text, read_calibration, read_clicks, write_clicks
from calib_core.measurements import Candidate, Pair, ReflectorClick, TimeNs
from calib_core.results import Calibration
from calib_core.synthetic import simulate_pairs

CLICK = ReflectorClick(TimeNs(1_700_000_000_000_000_000), "c1", 10.0, 20.0)


@pytest.fixture(scope="module")
def solved() -> Calibration:
    simulated = simulate_pairs(rng=np.random.default_rng(3))
    pairs = [replace(pair, candidates=_with_alternative(pair)) for pair in simulated.pairs]
    return calibrate_pairs(pairs, simulated.camera).unwrap()


def _with_alternative(pair: Pair) -> tuple[Candidate, Candidate]:
    best = replace(pair.candidates[0], score=0.5, alternative_of=0)
    elsewhere = best.position_radar_m * [1.0, -1.0, 1.0] + [0.0, 3.0, 0.0]
    return best, replace(best, position_radar_m=elsewhere)


def test_a_calibration_keeps_which_candidates_are_alternatives(solved: Calibration) -> None:
    text = calibration_text(solved)
    read = read_calibration(text).calibration
    for pair in read.pairs:
        assert pair.measured is not None
        assert [one.alternative_of for one in pair.measured.candidates] == [0, 0]
    again = solve_again(read)
    assert isinstance(again, Calibration)
    assert calibration_text(again) == text


def test_candidates_without_alternatives_have_no_such_key() -> None:
    simulated = simulate_pairs(rng=np.random.default_rng(3))
    assert "alternative_of" not in calibration_text(calibrate_pairs(simulated.pairs, simulated.camera).unwrap())


def test_the_provenance_names_all_topics_of_the_radar_and_why_it_was_used(solved: Calibration) -> None:
    provenance = Provenance(radar_topic="/far", radar_topics=("/far", "/near"), radar_choice="/far + /near: 52 returns")
    text = calibration_text(solved, provenance=provenance)
    assert json.loads(text)["provenance"]["topics"] == {
        "radar": "/far",
        "image": None,
        "camera_info": None,
        "radar_all": ["/far", "/near"],
        "radar_choice": "/far + /near: 52 returns",
    }
    assert read_calibration(text).provenance == provenance
    single = Provenance(radar_topic="/radar", radar_topics=("/radar",))
    text = calibration_text(solved, provenance=single)
    assert set(json.loads(text)["provenance"]["topics"]) == {"radar", "image", "camera_info"}
    assert read_calibration(text).provenance == single


def test_clicks_say_which_topics_they_were_made_with_if_there_are_several() -> None:
    text = write_clicks([CLICK], radar_topics=("/far", "/near"))
    assert json.loads(text)["radar_topics"] == ["/far", "/near"]
    assert read_clicks(text) == (CLICK,)
    assert write_clicks([CLICK], radar_topics=("/radar",)) == write_clicks([CLICK])
    with pytest.raises(InputError, match="radar_topics"):
        read_clicks(text.replace('"/far"', "7"))
