"""The solver's thread answers the newest revision only, and every failure is an answer."""

import logging
import threading
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.errors import RecordingError
from calib_core.measurements import RadarScans
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from cocalib.session.events import Solved
from cocalib.solving.worker import SolverWorker
from tests.unit.app.solving.test_solving import CLICK, Radar

CAMERA = Camera("pinhole", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))


class Gate:
    """A radar that blocks reads until it is opened."""

    def __init__(self) -> None:
        self.entered, self.open = threading.Event(), threading.Event()

    def __call__(self) -> RadarScans:
        self.entered.set()
        assert self.open.wait(60)
        return RadarScans()


class Answers:
    """Collects answers and lets a test wait for them."""

    def __init__(self) -> None:
        self.all: list[Solved] = []
        self._some = threading.Semaphore(0)

    def __call__(self, solved: Solved) -> None:
        self.all.append(solved)
        self._some.release()

    def wait(self) -> Solved:
        assert self._some.acquire(timeout=60)
        return self.all[-1]


def test_of_several_waiting_requests_only_the_newest_is_solved_and_none_after_the_end():
    gate, answers = Gate(), Answers()
    radar = Radar(gate)
    worker = SolverWorker(radar, CAMERA)
    worker.request(1, [CLICK], CalibrationOptions(), answers)
    assert gate.entered.wait(60)
    for revision in (2, 3, 5, 4):
        worker.request(revision, [CLICK], CalibrationOptions(), answers)
    gate.open.set()
    while answers.wait().revision != 5:
        pass
    worker.close()
    worker.request(6, [CLICK], CalibrationOptions(), answers)
    assert [solved.revision for solved in answers.all] == [1, 5]
    assert len(radar.asked) == 2


def test_a_recording_that_cannot_be_read_is_reported_as_the_answer():
    def broken() -> RadarScans:
        raise RecordingError("radar.bag: chunk 7 is damaged; copy the file again")

    answers = Answers()
    worker = SolverWorker(Radar(broken), CAMERA)
    worker.request(1, [CLICK], CalibrationOptions(), answers)
    outcome = answers.wait().outcome
    worker.close()
    assert outcome.code == "unreadable"
    assert outcome.facts["why"].startswith("radar.bag: chunk 7 ")


def test_a_bug_in_the_program_is_logged_and_reported_and_the_worker_continues(caplog, tmp_path):
    faults = iter([True])

    def faulty() -> RadarScans:
        if next(faults, False):
            raise ZeroDivisionError("by zero")
        return RadarScans()

    answers = Answers()
    worker = SolverWorker(Radar(faulty), CAMERA)
    with caplog.at_level(logging.ERROR):
        worker.request(1, [CLICK], CalibrationOptions(), answers)
        outcome = answers.wait().outcome
    assert outcome.code == "internal-error"
    assert "(ZeroDivisionError: by zero)" in outcome.facts["fault"]
    assert str(tmp_path) in outcome.facts["fault"], "the report's place is told"
    assert "ZeroDivisionError" in caplog.text
    worker.request(2, [CLICK], CalibrationOptions(), answers)
    assert answers.wait().revision == 2
    worker.close()


def test_the_preview_is_delivered_before_the_answer_and_the_next_one_starts_from_it(monkeypatch):
    simulated = simulate_pairs(8, rng=np.random.default_rng(1))
    answer = calibrate_pairs(simulated.pairs, simulated.camera).unwrap()
    started_from = []

    def steps(*_: object, previous: Calibration | None, **__: object) -> Iterator[Calibration]:
        started_from.append(previous)
        yield replace(answer, checking=True)
        yield answer

    monkeypatch.setattr("cocalib.solving.worker.solve_in_steps", steps)
    answers = Answers()
    worker = SolverWorker(Radar(), CAMERA)
    for revision in (1, 2):
        worker.request(revision, [CLICK], CalibrationOptions(), answers)
        answers.wait()
        answers.wait()
    worker.close()
    outcomes = [(solved.revision, solved.outcome.checking) for solved in answers.all]
    assert outcomes == [(1, True), (1, False), (2, True), (2, False)]
    assert started_from == [None, answer]
