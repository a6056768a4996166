"""The steps of a job, on a recording that is opened once: each fails on its own, and without a calibration there is none."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from calib_core.measurements import Unsolvable
from calib_core.recordings import Recording, open_recording
from calib_core.results.verdict import verdict_on
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import StepState
from cocalib.batch.running.attempting import Failure, attempted
from cocalib.batch.running.exporting import export_session
from cocalib.batch.running.judging import EVALUATION_FILE, JudgedSession, judge_session
from cocalib.batch.running.reporting import REPORT_FILE, report_session
from cocalib.batch.running.solving import SolvedSession, given_files, solve_session

_Made = TypeVar("_Made")


@dataclass(slots=True, eq=False)
class SessionResult:
    """What the steps of a job made; it grows from step to step.

    Attributes:
        solved: the calibration, why there is none, or what went wrong; None until then.
        recorded_ns: first stamp of the recording [ns]; None if it has none.
        states: of the steps after solving.
        failures: of the steps that failed.
        files: of the result by their names in it.
        log: what only a developer needs.
    """

    solved: SolvedSession | Unsolvable | Failure | None = None
    recorded_ns: int | None = None
    states: dict[str, StepState] = field(default_factory=dict)
    failures: dict[str, Failure] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    log: list[str] = field(default_factory=list)


def run_steps(row: ManifestRow) -> SessionResult:
    """Solve, judge, report and export a session; whatever goes wrong is in the result."""
    result = SessionResult()
    failure = attempted(f"cocalib batch, {row.name}", lambda: _on_recording(row, result), result.log)
    if failure is not None:
        result.solved = failure
        result.files.clear()
    return result


def _on_recording(row: ManifestRow, result: SessionResult) -> None:
    given = given_files(row)
    with open_recording(row.recording, row.topics) as recording:
        times = recording.image_times if len(recording.image_times) else recording.radar_times
        result.recorded_ns = int(times[0]) if len(times) else None
        result.solved = solve_session(row, given, recording)
        if isinstance(result.solved, Unsolvable):
            result.log += [f"click {one.id}: {one.reason}; {one.hint}" for one in result.solved.unpaired]
        else:
            result.files |= result.solved.files
            _after_solving(row, result.solved, recording, result)


def _after_solving(row: ManifestRow, solved: SolvedSession, recording: Recording, result: SessionResult) -> None:
    judged = _step("evaluate", result, lambda: judge_session(row, solved, recording))
    if judged is not None:
        result.files[EVALUATION_FILE] = judged.text.encode()
    _report(solved, judged, recording, result)
    if not row.exports:
        result.states["export"] = "not asked"
        return
    if verdict_on(solved.calibration).level == "contradictory":
        result.states["export"] = "left out"  # nobody must use its pose
        return
    for name in row.exports:
        files = _step(f"export {name}", result, lambda name=name: export_session(solved, name, [*result.files]))  # type: ignore[misc]
        result.files |= files or {}
    states = [result.states.pop(f"export {name}") for name in dict.fromkeys(row.exports)]
    result.states["export"] = "failed" if "failed" in states else "done"


def _report(solved: SolvedSession, judged: JudgedSession | None, recording: Recording, result: SessionResult) -> None:
    text = _step("report", result, lambda: report_session(solved, judged, recording))
    if text is not None:
        result.files[REPORT_FILE] = text.encode()


def _step(name: str, result: SessionResult, work: Callable[[], _Made]) -> _Made | None:
    """Do a step; if it fails, note why."""
    made = attempted(name, work, result.log)
    if isinstance(made, Failure):
        result.states[name] = "failed"
        result.failures[name] = made
        return None
    result.states[name] = "done"
    return made
