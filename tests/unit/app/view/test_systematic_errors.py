"""The page and the command line say what the uncertainty rests on, and for a radar without elevation first what is firm."""

import re
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.results.systematic_errors import SystematicErrorResult
from cocalib.view.build import summary_lines
from cocalib.view.figures import assumed_figures, pose_figures, systematic_errors


def solved(*, flat: bool = False, options: CalibrationOptions | None = None) -> Calibration:
    simulated = simulate_pairs(20, rng=np.random.default_rng(1), noise="imaging")
    pairs = simulated.pairs
    if flat:
        pairs = tuple(
            replace(pair, candidates=(replace(one, position_radar_m=np.array([*one.position_radar_m[:2], 0.5])),))
            for pair in pairs
            for one in pair.candidates
        )
    return calibrate_pairs(pairs, simulated.camera, options).unwrap()


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return solved()


@pytest.fixture(scope="module")
def flat() -> Calibration:
    return solved(flat=True)


def error(name: str, position: float, rotation: float, *, sigma: float = 0.02) -> SystematicErrorResult:
    return SystematicErrorResult(name, 0.011, sigma, 0.02, True, position, rotation)


def test_the_table_shows_what_matters_or_is_determined_the_largest_first(calibration):
    known = (
        error("range_scale", 0.01, 0.0),
        error("azimuth_scale", 0.0, 0.02, sigma=0.004),
        error("elevation_scale", 0.4, 0.1),
    )
    table = systematic_errors(replace(calibration, systematic_errors=known))
    shown = [(row.figure.key, row.figure.level, row.position_percent, row.rotation_percent) for row in table.rows]
    assert shown == [("elevation_scale", "warning", 40, 10), ("azimuth_scale", "plain", 0, 2)]
    assert [row.figure.value for row in table.rows] == ["–", "1.1 ± 0.4"]
    assert [f"{row.prior} {row.figure.unit}" for row in table.rows] == ["± 2.0 %", "± 2.0 %"]
    assert len(table.sentences) == 1


def test_axes_that_the_pairs_do_not_determine_share_a_row(calibration):
    axes = (error("reflector_right_m", 0.05, 0.0), error("reflector_down_m", 0.04, 0.01))
    (row,) = systematic_errors(replace(calibration, systematic_errors=axes)).rows
    assert ("phase center" in row.figure.label, row.position_percent, row.rotation_percent) == (True, 9, 1)
    apart = (replace(axes[0], sigma=0.01), axes[1])
    labels = [row.figure.label for row in systematic_errors(replace(calibration, systematic_errors=apart)).rows]
    assert labels == ["clicks right of center", "clicks below center"]


def test_the_command_line_says_the_same_as_the_page(calibration):
    lines = tuple(map(str, summary_lines(calibration)))
    assert [line.removeprefix("uncertainty: ") for line in lines if line.startswith("uncertainty: ")] == list(
        map(str, systematic_errors(calibration).sentences)
    )
    assert " ".join(lines).casefold().count("placements at several heights") == 1
    assert any(line.startswith("in the image") for line in lines)
    assert assumed_figures(calibration) == ()


def test_a_radar_without_elevation_shows_first_what_is_firm(flat):
    figures = {one.key: one.value for one in pose_figures(flat)}
    assert list(figures)[:4] == ["camera_x", "camera_y", "yaw", "image"]
    assert [one.key for one in assumed_figures(flat)] == ["camera_z", "roll", "pitch"]
    lines = tuple(map(str, summary_lines(flat)))
    labels = [line.split("  ")[0] for line in lines[3:7]]
    assert [label.split(" ")[0] for label in labels] == ["camera", "camera", "yaw", "in"]
    assert "no elevation: camera " in next(line for line in lines[2:] if "assumed" in line)


def test_the_summary_says_how_many_clicks_agree_and_at_how_many_placements(calibration):
    count = len(calibration.pairs)
    lines = tuple(map(str, summary_lines(calibration)))
    counted = [re.findall(r"\d+", line) for line in lines if line.startswith(("clicks that", "placements (pairs)"))]
    assert counted == [[str(count)] * 2, [str(count)]]


def test_a_calibration_from_a_file_looks_the_same(calibration, flat):
    for solved_here in (calibration, flat):
        one = replace(solved_here, next_placement=None)  # a file holds none
        read = read_calibration(calibration_text(one)).calibration
        assert systematic_errors(read) == systematic_errors(one)
        assert summary_lines(read) == summary_lines(one)
        assert str(read).partition("next")[0] == str(one).partition("next")[0]


def test_the_papers_method_has_no_table():
    paper = solved(options=CalibrationOptions(method="paper"))
    assert not systematic_errors(paper).rows
    assert not systematic_errors(paper).sentences
