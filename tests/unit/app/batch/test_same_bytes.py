"""A job gives the bytes of the commands."""

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from calib_core.options import CalibrationOptions, CameraPositionPrior, RefiningOptions, SolvingOptions
from calib_core.results import UnconfirmedClicks
from cocalib.batch import solving
from cocalib.batch.job import job_of
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder
from cocalib.batch.running_job import run_job
from cocalib.cli import run
from cocalib.solving import automatic as automatic_solving
from cocalib.solving.automatic import PlacedClicks

AGREEMENT = {"certain": 9, "placements": 9, "score": 40.0, "by_chance": 25.0, "rival": 10.0}
SAMPLE = Path(__file__).resolve().parents[4] / "sample_data" / "rooftop"
BAGS = (SAMPLE / "radar.bag", SAMPLE / "camera.bag")
CLICKS = SAMPLE / "clicks.json"
SENSORS = {"vehicle_type": "long", "radar_serial": "R-1", "camera_serial": "C-2"}
VEHICLE = (
    *("--vehicle", "van", "--session-name", "1"),
    *("--vehicle-type", "long", "--radar-serial", "R-1", "--camera-serial", "C-2"),
)


def done(row: ManifestRow, results: Path) -> tuple[Outcome, dict[str, bytes]]:
    """Run the job of a row; return its outcome and its files."""
    job = job_of(row)
    outcome = run_job(job, results)
    folder = ResultsFolder(results).folder_of(job.digest)
    files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    files.pop(OUTCOME_FILE)
    return outcome, files


class Commands:
    """Runs commands on the sample and keeps what they write."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder, self.capsys = folder, capsys
        self.calibration = folder / "calibration.json"

    def solve(self, *flags: str | Path) -> bytes:
        self._run("solve", *BAGS, *flags, *VEHICLE, "--out", self.calibration)
        return self.calibration.read_bytes()

    def evaluate(self, *flags: str | Path) -> bytes:
        return self._run("evaluate", self.calibration, *BAGS, *flags, "--json").encode()

    def report(self, *flags: str | Path) -> bytes:
        self._run("evaluate", self.calibration, *BAGS, *flags, "--report", self.folder / "report.html")
        return (self.folder / "report.html").read_bytes()

    def export(self, name: str, out: Path) -> None:
        self._run("export", self.calibration, "--to", name, "--out", out)

    def _run(self, *arguments: str | Path) -> str:
        self.capsys.readouterr()
        assert run([str(argument) for argument in arguments]) == 0
        return self.capsys.readouterr().out


@pytest.fixture
def commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Commands:
    (tmp_path / "commands").mkdir()
    return Commands(tmp_path / "commands", capsys)


@pytest.mark.slow
def test_a_clicked_session(commands, tmp_path):
    row = ManifestRow("van", "1", BAGS, **SENSORS, clicks=CLICKS, exports=("tf2", "opencv", "colmap"))
    outcome, files = done(row, tmp_path / "results")
    assert (outcome.status, outcome.is_final, outcome.step_reasons) == ("solved", True, {})
    assert outcome.steps == {"evaluate": "done", "report": "done", "export": "done"}
    assert files["calibration.json"] == commands.solve("--clicks", CLICKS)
    assert files["evaluation.json"] == commands.evaluate("--clicks", CLICKS)
    assert files["report.html"] == commands.report("--clicks", CLICKS)
    exports = tmp_path / "exports"
    exports.mkdir()
    commands.export("tf2", exports)
    commands.export("opencv", exports)
    commands.export("colmap", exports)
    assert {name: data for name, data in files.items() if name.startswith("export/")} == {
        f"export/{path.name}": path.read_bytes() for path in exports.iterdir()
    }
    again, same = done(row, tmp_path / "elsewhere")
    assert same == files
    assert replace(again, run=None) == replace(outcome, run=None)


@pytest.mark.slow
def test_intrinsics_of_a_file_a_measured_position_and_options(commands, tmp_path):
    given = tmp_path / "camera.yaml"
    commands.solve("--clicks", CLICKS)
    commands.export("camera-info", given)
    options = CalibrationOptions(
        solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.02)),
        refining=RefiningOptions(intrinsics=True),
    )
    row = ManifestRow("van", "1", BAGS, **SENSORS, clicks=CLICKS, camera=given, rescale_camera=True, options=options)
    given_camera = solving.given_files(row).camera
    assert given_camera.rescale
    outcome, files = done(row, tmp_path / "results")
    flags = ("--camera-position-m", "0", "0", "0.045", "--camera-position-sigma-m", "0.02", "--refine-intrinsics")
    assert files["calibration.json"] == commands.solve(
        "--clicks", CLICKS, "--camera", given, "--rescale-camera", *flags
    )
    assert json.loads(files["calibration.json"])["provenance"]["inputs"][-1]["name"] == "camera.yaml"
    assert files["report.html"] == commands.report("--clicks", CLICKS)
    assert outcome.steps["evaluate"] == "done"


@pytest.mark.slow
def test_clicks_of_a_person_and_of_nobody(commands, tmp_path, monkeypatch):
    given = tmp_path / "clicks.json"
    document = json.loads(CLICKS.read_text())
    given.write_text(json.dumps({**document, "clicks": document["clicks"][:4]}))
    sample = solving.file_of_clicks(CLICKS).clicks

    def place(_recording: object, _camera: object, _options: object, **flags: object) -> PlacedClicks:
        assert flags["reflector_m"] == 0.3
        confirmed = flags["confirmed"]
        assert isinstance(confirmed, tuple)
        assert len(confirmed) == 4
        known = {click.id for click in confirmed}
        rest = tuple(click for click in reversed(sample) if click.id not in known)
        return PlacedClicks((*confirmed, *rest), UnconfirmedClicks(tuple(one.id for one in rest), 0.99), AGREEMENT)

    monkeypatch.setattr(solving, "place_clicks", place)
    monkeypatch.setattr(automatic_solving, "place_clicks", place)
    outcome, files = done(
        ManifestRow("van", "1", BAGS, **SENSORS, clicks=given, auto=True, reflector_m=0.3), tmp_path / "results"
    )
    placed = commands.folder / "clicks.json"
    assert files["calibration.json"] == commands.solve(
        "--clicks", given, "--auto", "--reflector-m", "0.3", "--clicks-out", placed
    )
    assert files["clicks.json"] == placed.read_bytes()
    assert files["evaluation.json"] == commands.evaluate("--clicks", placed)
    assert files["report.html"] == commands.report("--clicks", placed)
    assert "nobody-confirmed" in outcome.warnings
    assert any("score 40" in note for note in outcome.notes)
