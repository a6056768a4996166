"""`cocalib evaluate --report`: calibrations of every kind, a recording, and what cannot be done."""

from pathlib import Path

import pytest

from cocalib.cli import run


@pytest.fixture(scope="module")
def sample(project_root: Path) -> Path:
    return project_root / "sample_data" / "rooftop"


@pytest.fixture(scope="module")
def golden(project_root: Path) -> Path:
    return project_root / "tests" / "golden" / "calibration-1.json"


@pytest.fixture(scope="module")
def solved(sample: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("solved") / "calibration.json"
    bags = [str(sample / "radar.bag"), str(sample / "camera.bag")]
    assert run(["solve", *bags, "--clicks", str(sample / "clicks.json"), "--out", str(out)]) == 0
    return out


def test_on_its_recording_the_report_has_held_out_errors_and_a_picture_and_names_no_folder(solved, sample, tmp_path):
    bags = [str(sample / "radar.bag"), str(sample / "camera.bag")]
    out = tmp_path / "report.html"
    assert run(["evaluate", str(solved), *bags, "--against", str(solved), "--report", str(out)]) == 0
    html = out.read_text(encoding="utf-8")
    assert "Residuals at the clicks in radar.bag + camera.bag, which it was solved from" in html
    assert "data:image/jpeg;base64," in html
    assert 'class="return"' in html
    assert "no difference on this recording" in html.lower()
    for folder in (solved.parent, sample, tmp_path):
        assert str(folder) not in html
    assert len(html.encode()) < 3_000_000


def test_a_foreign_calibration_without_a_camera_takes_the_one_of_the_recording(golden, solved, sample, tmp_path):
    foreign, out = tmp_path / "tf.txt", tmp_path / "tf.html"
    assert run(["export", str(solved), "--to", "tf2", "--out", str(foreign)]) == 0
    assert run(["evaluate", str(foreign), "--report", str(out)]) == 0
    assert "The file contains no camera" in out.read_text(encoding="utf-8")
    bags = [str(sample / "radar.bag"), str(sample / "camera.bag")]
    assert run(["evaluate", str(foreign), *bags, "--clicks", str(sample / "clicks.json"), "--report", str(out)]) == 0
    html = out.read_text(encoding="utf-8")
    assert "The file contains no camera" not in html
    assert "Residuals at the clicks in radar.bag + camera.bag" in html


def test_without_a_browser_the_html_is_written_and_the_pdf_is_refused(golden, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COCALIB_BROWSER", "/nowhere/browser")
    out, pdf = tmp_path / "out.html", tmp_path / "out.pdf"
    assert run(["evaluate", str(golden), "--report", str(pdf), "--report", str(out)]) == 2
    assert "COCALIB_BROWSER=/nowhere/browser is not a program" in capsys.readouterr().err
    assert out.exists()
    assert not pdf.exists()
