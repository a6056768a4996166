"""`cocalib evaluate --report`: calibrations of every kind, a recording, and what cannot be done."""

import pytest


@pytest.mark.slow
def test_on_its_recording_the_report_has_held_out_errors_and_an_image_and_names_no_folder(
    cocalib, solved_sample, bags, sample, tmp_path
):
    out = tmp_path / "report.html"
    assert cocalib("evaluate", solved_sample, *bags, "--report", out).code == 0
    html = out.read_text(encoding="utf-8")
    assert "in camera.bag + radar.bag" in html
    assert "data:image/jpeg;base64," in html
    assert 'class="return"' in html
    for folder in (solved_sample.parent, sample, tmp_path):
        assert str(folder) not in html
    assert len(html.encode()) < 3_000_000


@pytest.mark.slow
def test_a_foreign_calibration_without_a_camera_takes_the_one_of_the_recording(cocalib, solved, clicks_file, tmp_path):
    foreign, out = tmp_path / "tf.txt", tmp_path / "tf.html"
    assert cocalib("export", solved, "--to", "tf2", "--out", foreign).code == 0
    for recording, has_camera in (((), False), ((solved.with_name("made.mcap"), "--clicks", clicks_file), True)):
        assert cocalib("evaluate", foreign, *recording, "--report", out).code == 0
        html = out.read_text(encoding="utf-8")
        assert ("contains no camera" in html) == (not has_camera)
        assert ("clicks in made.mcap" in html) == has_camera


def test_without_a_browser_the_html_is_written_and_the_pdf_is_refused(cocalib, golden, tmp_path, monkeypatch):
    monkeypatch.setenv("COCALIB_BROWSER", "/nowhere/browser")
    out, pdf = tmp_path / "out.html", tmp_path / "out.pdf"
    answer = cocalib("evaluate", golden, "--report", pdf, "--report", out)
    assert answer.code == 2
    assert "COCALIB_BROWSER=/nowhere/browser" in answer.err
    assert (out.exists(), pdf.exists()) == (True, False)
