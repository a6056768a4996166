"""The report's section on a fleet's prior: fleet, data alone and answer side by side."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from calib_core.fleet_prior import DataAlone, FleetAnswer, FleetPrior
from calib_core.results import Calibration, DataWarning
from cocalib.report import report_html
from cocalib.view.fleet_answer import fleet_axes, fleet_sentences
from tests.unit.app.report.planted import golden, subject_for

_SCATTER = np.diag([0.02] * 3 + [0.01] * 3) ** 2


def _with_fleet(calibration: Calibration, *, used: bool = True, tested: bool = True) -> Calibration:
    pose = calibration.camera_from_radar
    alone = DataAlone(pose.perturbed(np.array([0, 0, 0, 0.02, 0, 0])), 4.0 * _SCATTER, 12.6) if tested else None
    prior = FleetPrior("<van>", pose, _SCATTER, tuple(f"V{k}" for k in range(20)))
    return replace(calibration, fleet=FleetAnswer(prior, used, alone, 3.0 if tested else np.nan, 28.0))


def test_the_three_stand_side_by_side_with_their_sigmas(project_root: Path) -> None:
    axes = fleet_axes(_with_fleet(golden(project_root)))
    assert [axis.label for axis in axes] == ["camera forward", "camera left", "camera up", "roll", "pitch", "yaw"]
    assert all(float(axis.fleet.split(" ± ")[0]) == 0.0 and "±" in axis.alone for axis in axes)
    turned = [abs(float(axis.alone.split(" ")[0])) for axis in axes[3:]]
    assert np.hypot(np.hypot(*turned[:2]), turned[2]) < 1.3  # 0.02 rad
    assert max(turned) > 0.5
    assert all(float(axis.answer.split(" ")[0]) == 0.0 for axis in axes)


def test_the_words_say_whether_it_was_used_and_tested(project_root: Path) -> None:
    known = golden(project_root)
    assert fleet_sentences(known) == ()
    used, data, away = fleet_sentences(_with_fleet(known))
    assert used.startswith("The pose rests on the data and on the prior of type <van> (20 vehicles): ")
    assert data.startswith("The data alone: ")
    assert away.startswith("They are 1.1 deg and ")
    assert "and agree with the prior: squared distance" in away
    judged = _with_fleet(known)
    assert judged.fleet is not None
    assert judged.fleet.data_alone is not None
    few = replace(judged.fleet.data_alone, verdict="weak", reason="uncertain to 4 deg, 50 cm (95 %), from only 6 pairs")
    said = fleet_sentences(replace(judged, fleet=replace(judged.fleet, data_alone=few)))[1]
    assert said == "The data alone would be weak: uncertain to 4 deg, 50 cm (95 %), from only 6 pairs."
    away = judged.camera_from_radar.perturbed(np.array([0.0, 0.0, 0.0, 0.11, 0.0, 0.0]))
    odd = replace(
        judged, fleet=replace(judged.fleet, data_alone=replace(judged.fleet.data_alone, camera_from_radar=away))
    )
    assert "and farther from the prior than 19 of 20 sound vehicles: " in fleet_sentences(odd)[2]
    far = replace(judged, warnings=(DataWarning("far-from-its-kind", "far", "look"),))
    assert "and far from the prior, though not beyond the point where they contradict it: " in fleet_sentences(far)[2]
    assert fleet_sentences(_with_fleet(known, used=False))[0].startswith("Not used, as the data contradict the prior")
    assert "not tested" in fleet_sentences(_with_fleet(known, tested=False))[0]


def test_the_report_shows_it_escaped_and_only_where_there_is_one(project_root: Path) -> None:
    subject = subject_for(project_root)
    assert 'id="fleet-prior"' not in report_html(subject)
    informed = replace(subject, calibration=_with_fleet(golden(project_root)))
    html = report_html(informed)
    assert "With the fleet's prior of type &lt;van&gt;" in html.replace("&#x27;", "'")
    assert "and 8 more" in html
