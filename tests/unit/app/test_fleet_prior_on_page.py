"""The page with a fleet's prior: its answers and its file are those of `solve --fleet-prior`."""

import asyncio
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from calib_core.fleet_prior import FleetPrior
from calib_core.interchange.own.fleet_prior_json import write_fleet_prior
from calib_core.measurements import ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.recordings import Recording
from calib_core.results import Calibration
from cocalib.session import History, RecordingFacts, Session, Solved
from cocalib.solving.fleet_prior_file import FleetPriorFile
from cocalib.solving.solving import calibration_text, solve_clicks
from cocalib.solving.worker import SolverWorker
from cocalib.view import view
from cocalib.web.port.routes import Routes

DEFAULTS = CalibrationOptions()
SCATTER = np.diag([5e-3] * 3 + [np.deg2rad(0.3)] * 3) ** 2


@pytest.fixture(scope="module")
def given(recording: Recording, clicks: tuple[ReflectorClick, ...], tmp_path_factory: pytest.TempPathFactory) -> Any:
    whole = solve_clicks(recording, clicks, recording.camera(), DEFAULTS).unwrap()
    path = tmp_path_factory.mktemp("prior") / "van.json"
    path.write_text(write_fleet_prior(FleetPrior("van", whole.camera_from_radar, SCATTER, ("V1", "V2", "V3"))))
    return FleetPriorFile.read(path)


def answered(worker: SolverWorker, clicks: tuple[ReflectorClick, ...], options: CalibrationOptions) -> list[Solved]:
    found: list[Solved] = []
    done = threading.Event()

    def take(solved: Solved) -> None:
        found.append(solved)
        if not (isinstance(solved.outcome, Calibration) and solved.outcome.checking):
            done.set()

    answered.revision += 1  # type: ignore[attr-defined]
    worker.request(answered.revision, clicks, options, take)  # type: ignore[attr-defined]
    assert done.wait(120)
    return found


answered.revision = 0  # type: ignore[attr-defined]


def test_preview_and_answer_rest_on_it_and_other_methods_do_not(
    recording: Recording, clicks: tuple[ReflectorClick, ...], given: FleetPriorFile
) -> None:
    worker = SolverWorker(recording, recording.camera(), fleet_prior=given.prior)
    try:
        first = answered(worker, clicks[:5], DEFAULTS)[-1].outcome
        preview, second = (one.outcome for one in answered(worker, clicks[:6], DEFAULTS))
        paper = answered(worker, clicks[:6], CalibrationOptions(method="paper"))[-1].outcome
    finally:
        worker.close()
    expected = solve_clicks(recording, clicks[:6], recording.camera(), DEFAULTS, given.prior).unwrap()
    for outcome in (first, preview, second):
        assert isinstance(outcome, Calibration)
    assert first.fleet_prior is preview.fleet_prior is second.fleet_prior is given.prior
    assert preview.checking
    assert np.diag(preview.covariance)[:3].max() < 1e-4  # the data alone say 20 cm
    assert np.array_equal(second.covariance, expected.covariance)
    assert isinstance(paper, Unsolvable)
    assert paper.code == "no-consensus"  # its own reason, not that it takes no prior


def test_the_view_says_what_it_did_and_the_download_is_the_file_of_solve(
    recording: Recording, clicks: tuple[ReflectorClick, ...], given: FleetPriorFile, project_root: Path
) -> None:
    camera = recording.camera()
    solved = solve_clicks(recording, clicks[:6], camera, DEFAULTS, given.prior).unwrap()
    session = Session(clicks=clicks[:6], outcome=solved, outcome_revision=0)
    facts = RecordingFacts("sample", recording.image_times, solved.camera.width_px, solved.camera.height_px)
    seen = view(History(session), facts, None)
    assert seen.fleet[0].startswith("The pose rests on the data and on the prior of type van (3 vehicles)")
    assert seen.verdict.action.startswith("Add placements")
    workspace: Any = SimpleNamespace(session=session, facts=facts, camera_file=None, fleet_prior=given)
    routes = Routes(project_root / "static")
    routes.admit(workspace, recording, SimpleNamespace(survey=None))  # type: ignore[arg-type]
    reply = asyncio.run(routes.answer("/api/calibration.json"))
    assert reply.body.decode() == calibration_text(solved, recording, fleet_prior=given.file)
