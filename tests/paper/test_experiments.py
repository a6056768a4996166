"""The paper's experiments: recordings with pictures, read from bags and solved, give what the table's scans alone give."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.paper.fit import AZIMUTHS_DEG, ELEVATIONS_DEG, mismatch_of, read_fit
from benchmarks.paper.limits import PAPER, missed, order_kept, verdict_of
from benchmarks.paper.measured import AccRow, Measured, read_measured, write_measured
from benchmarks.paper.page import page
from benchmarks.paper.rows import Figures, Seed
from benchmarks.paper.settings import (
    FIT_SEEDS,
    FITTED,
    SEEDS,
    Dataset,
    options_of,
    ppm_options,
)
from calib_core.calibration import calibrate
from calib_core.options import CalibrationOptions
from calib_core.synthetic import SimulatedScans, simulate, simulate_scans, write_recording
from cocalib.cli import run as cocalib

SMALL = dataclasses.replace(FITTED, width_px=480, placements=5)


def recorded(dataset: Dataset, folder: Path) -> SimulatedScans:
    """Write a data set as bags and clicks; return its scans alone."""
    options = dataclasses.replace(options_of(dataset, 1, SMALL, board_corners=5), camera_rate_hz=1.0)
    write_recording(simulate(options), folder)
    return simulate_scans(options)


def solved(folder: Path, options: CalibrationOptions, *flags: object) -> dict[str, float]:
    """Solve by the command and return the metrics of the file."""
    out = folder / "calibration.json"
    bags = [folder / "radar.bag", folder / "camera.bag"]
    arguments = ["solve", *bags, "--clicks", folder / "clicks.json", "--out", out, "--method", options.method, *flags]
    assert cocalib([str(one) for one in arguments]) == 0
    return json.loads(out.read_text())["metrics"]


@pytest.mark.parametrize("dataset", ["d1", "d3", "dr-a", "dr-b"])
def test_bags_clicks_and_the_command_give_what_the_scans_alone_give(dataset: Dataset, tmp_path: Path) -> None:
    simulated = recorded(dataset, tmp_path)
    alone = calibrate(simulated.clicks, simulated.scans, simulated.camera, ppm_options(SMALL)).unwrap()
    found = solved(tmp_path, ppm_options(SMALL))
    assert found["n"] == alone.metrics.n == 5
    assert found["aed_px"] == pytest.approx(alone.metrics.aed_px, abs=0.02)


def test_the_tables_settings_are_the_best_of_the_committed_fit() -> None:
    places = read_fit()
    figures = {(one.constant_azimuth_deg, one.constant_elevation_deg): one for one in places}
    assert sorted(figures) == [(azimuth, elevation) for azimuth in AZIMUTHS_DEG for elevation in ELEVATIONS_DEG]
    worked_out = {place: mismatch_of(one.aed_d1_px, one.cdsd_d1_px, one.ratio_d2) for place, one in figures.items()}
    assert all(one.mismatch == pytest.approx(worked_out[place], abs=1e-4) for place, one in figures.items())
    best = min(worked_out, key=lambda place: worked_out[place])
    assert (FITTED.constant_azimuth_deg, FITTED.constant_elevation_deg) == best
    assert AZIMUTHS_DEG[0] < best[0] < AZIMUTHS_DEG[-1]
    assert ELEVATIONS_DEG[0] < best[1] < ELEVATIONS_DEG[-1]
    assert not set(FIT_SEEDS) & set(SEEDS)


def test_the_fit_compares_with_the_papers_figures_of_d1_and_d2() -> None:
    assert mismatch_of(15.31, 9.40, 2.65) == pytest.approx(0.0, abs=1e-12)
    assert mismatch_of(15.31 * np.e, 9.40, 2.65 / np.e**2) == pytest.approx(1.0 + 4.0)


def test_a_row_says_whether_it_reaches_its_limit() -> None:
    assert verdict_of("PPM+D1", [Figures(15.31 * 1.14, 9.4, 0.0)]) == "reached: AED +14 %, CDSD +0 %; limit 15 %"
    assert verdict_of("PPM+D1", [Figures(15.31 * 1.16, 9.4, 0.0)]) == "missed: AED +16 %, CDSD +0 %; limit 15 %"
    assert verdict_of("PPM+D1", [Figures(15.31, 9.4 * 0.8, 0.0)]) == "missed: AED +0 %, CDSD -20 %; limit 15 %"
    assert verdict_of("PMM+D1", [Figures(79.0 * 0.76, 19.0, 0.0)]) == "reached: AED -24 %, CDSD +0 %; limit 25 %"
    assert verdict_of("PPM+D2", [Figures(15.0, 10.0, 0.0)]) == "missed: AED / CDSD -43 %; limit 15 %"
    assert verdict_of("PPM+DR-A", [Figures(15.0, 9.0, 0.0)]) == "no figure to compare with"


def test_the_rows_that_miss_their_limit_are_named_below_the_table() -> None:
    good, bad = Figures(15.31, 9.4, 0.0), Figures(15.0, 10.0, 0.0)
    assert missed([Seed({"PPM+D1": good})]) == "No row misses its limit."
    assert (
        missed([Seed({"PPM+D1": good, "PPM+D2": bad})])
        == "Rows that miss their limit: PPM+D2 (AED / CDSD -43 %; limit 15 %)."
    )


def test_the_order_of_the_rows_is_compared_with_the_papers() -> None:
    known = {"PPM+D3": 11.0, "PPM+D1": 15.0, "R_PPM+T_m+D1": 16.0, "PMM+D1": 80.0, "R_I+T_c+D1": 85.0}
    kept = Seed({name: Figures(aed, 9.0, 0.0) for name, aed in known.items()})
    assert order_kept([kept]).endswith("Ours is the same.")
    turned = Seed({**kept.rows, "R_I+T_c+D1": Figures(70.0, 9.0, 0.0)})
    assert order_kept([turned]).endswith("R_I+T_c+D1 < PMM+D1.")


def measured_once() -> Measured:
    one = Seed({name: Figures(20.0, 10.0, 1.0) for name in PAPER})
    people = AccRow("people", "89 %", (0.91,), (0.92,), (0.93,), (0.02,))
    return Measured("today", (one,), (("nothing", (one,)),), (people,))


def test_the_page_has_all_rows_and_says_what_is_not_available() -> None:
    text = page(measured_once(), FITTED, read_fit(), command="it")
    assert len(PAPER) == 8
    for name in PAPER:
        assert f"\n| {name} | " in text
    assert "| PPM+DR-A | not available to us |" in text
    assert "| people | 89 % | 91 % (91 to 91) | 92 % (92 to 92) | 93 % (93 to 93) | 2 % (2 to 2) |" in text
    assert "{" not in text


def test_the_figures_of_a_run_come_back_from_their_file(tmp_path: Path) -> None:
    path = tmp_path / "measured.json"
    write_measured(measured_once(), path)
    assert read_measured(path) == measured_once()


def test_the_documented_page_is_what_the_last_run_measured() -> None:
    documented = Path(__file__).parents[2] / "docs" / "paper-experiments.md"
    assert documented.read_text(encoding="utf-8") == page(read_measured(), FITTED, read_fit(), command="make paper")
