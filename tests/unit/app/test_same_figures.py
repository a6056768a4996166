"""The page, `evaluate`, `compare` and `check --against` state the same figures of the same calibration."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calib_core.evaluation.target_tracking import find_targets
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.check.agreement import compare
from calib_core.interchange.check.report import check
from calib_core.interchange.format import imported
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.recordings import Recording
from calib_core.results import Calibration
from cocalib.evaluation.evaluating import evidence_in, judged
from cocalib.session.applying import History
from cocalib.session.state import RecordingFacts, Session
from cocalib.solving.solving import solve_clicks
from cocalib.view.acc_panel import acc_panel
from cocalib.view.build import view
from cocalib.view.reference import Reference
from cocalib.view.wording import plain, with_sigma
from cocalib.web.messages.outgoing import encode
from tests.box_figures import box_figures
from tests.street_recording import StreetRecording, reference_calibration


@pytest.fixture(scope="module")
def solved(recording: Recording, clicks: tuple[ReflectorClick, ...]) -> Calibration:
    return solve_clicks(recording, clicks, recording.camera(), CalibrationOptions()).unwrap()


def figures_of(rows: object) -> dict[str, str]:
    return {row.key: row.value for row in rows}


def shown(solved: Calibration, recording: Recording, clicks: tuple[ReflectorClick, ...], reference: Reference | None):
    session = Session(clicks=clicks, outcome=solved, outcome_revision=0)
    facts = RecordingFacts("sample", recording.image_times, solved.camera.width_px, solved.camera.height_px)
    return view(History(session), facts, reference)


@pytest.mark.slow
def test_the_residuals_on_the_page_are_those_of_evaluate(recording, clicks, solved):
    figures = judged(solved, evidence_in(recording, solved.camera, clicks=clicks)).residuals
    page, metrics = figures_of(shown(solved, recording, clicks, None).metrics), figures.metrics
    for key, value in {"aed": metrics.aed_px, "cdsd": metrics.cdsd_px, "rms": metrics.rms_px}.items():
        assert page[key] == plain(value)
    assert page["held_out_aed"] == plain(metrics.held_out_aed_px)
    assert page["inliers"] == f"{figures.inliers.sum()} of {len(figures.ids)}"
    assert metrics.aed_px == pytest.approx(solved.metrics.aed_px, rel=1e-12)


def test_the_comparison_on_the_page_is_that_of_check(recording, clicks, solved):
    turn = RigidTransform(rotation_exp(np.deg2rad([0.4, -0.3, 1.1])), np.array([0.02, -0.05, 0.01]))
    other = replace(solved, camera_from_radar=turn @ solved.camera_from_radar)
    both = compare(imported(CalibrationFile(other)), imported(CalibrationFile(solved)))
    page = figures_of(shown(solved, recording, clicks, Reference("other.json", other)).comparison)
    assert page["rotation_apart"] == with_sigma(both.rotation_deg, both.rotation_sigma_deg)
    assert page["position_apart"] == with_sigma(both.position_cm, both.position_sigma_cm)
    assert page["rotation_apart"].startswith("1.2")
    checked = check(imported(CalibrationFile(solved)), against=imported(CalibrationFile(other))).comparison
    assert (checked.rotation_deg, checked.position_cm) == (both.rotation_deg, both.position_cm)
    for at in both.pixels:
        assert page[f"apart_{at.distance_m:g}_m"] == plain(at.rms_px)


def test_acc_on_the_page_is_that_of_the_core():
    walk, calibration = StreetRecording(), reference_calibration().calibration
    evaluation = judged(calibration, evidence_in(walk, calibration.camera, boxes=walk.street.boxes), held_out=False)
    of_one = acc_panel(evaluation)
    assert (of_one.sensitivity, of_one.caution[:10]) == ((), "Too little")
    assert evaluation.boxes is not None
    panel = acc_panel(replace(evaluation, boxes=replace(evaluation.boxes, matched_targets=3)))
    assert panel.figures[0] == of_one.figures[0]
    found = find_targets([walk.street.scans]).tracks
    core = box_figures(
        calibration.camera_from_radar, walk.camera(), walk.street.scans, walk.street.boxes, targets=found
    )
    assert core.acc is not None
    assert figures_of(panel.figures)["acc"].split(" ±")[0] == f"{100 * core.acc:.1f}"
    assert [row.axis for row in panel.sensitivity] == ["roll", "pitch", "yaw"]
    assert all(row.values[1] == f"{100 * core.acc:.1f} %" for row in panel.sensitivity)
    assert "not accuracy" in panel.caution
    assert json.loads(encode(panel))["figures"][0]["key"] == "acc"
