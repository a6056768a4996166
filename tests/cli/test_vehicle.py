"""`cocalib solve --vehicle …`: the calibration says which vehicle it is of, and so does the report."""

import json


def test_the_file_names_it_keeps_it_and_the_report_shows_it(cocalib, pairs_file, tmp_path):
    out, again, report = (tmp_path / name for name in ("calibration.json", "again.json", "report.html"))
    stated = ("--vehicle", "V<1>", "--vehicle-type", "van", "--session-name", "autumn")
    serials = ("--radar-serial", "R-1", "--camera-serial", "C-2")
    assert cocalib("solve", "--pairs", pairs_file, "--out", out, *stated, *serials).code == 0
    expected = {"name": "V<1>", "type": "van", "session": "autumn", "radar_serial": "R-1", "camera_serial": "C-2"}
    assert json.loads(out.read_text())["vehicle"] == expected
    assert cocalib("solve", "--pairs", out, "--out", again, "--session-name", "winter").code == 0
    assert json.loads(again.read_text())["vehicle"] == expected | {"session": "winter"}
    assert cocalib("evaluate", out, "--report", report).code == 0
    html = report.read_text()
    assert "V&lt;1&gt;, of type van" in html
    assert "radar R-1, camera C-2" in html
    assert "V<1>" not in html


def test_nothing_stated_writes_nothing(cocalib, pairs_file, tmp_path):
    assert cocalib("solve", "--pairs", pairs_file, "--out", tmp_path / "calibration.json").code == 0
    assert "vehicle" not in json.loads((tmp_path / "calibration.json").read_text())


def test_a_calibration_from_a_recording_differs_in_what_was_stated_alone(cocalib, made, clicks_file):
    recording, flags = made(), ("--vehicle", "V017", "--camera-serial", "C-2")
    stated, plain = (cocalib("solve", recording, "--clicks", clicks_file, *given) for given in (flags, ()))
    assert (stated.code, plain.code) == (0, 0), stated.err + plain.err
    document = json.loads(stated.out)
    assert document.pop("vehicle") == {"name": "V017", "camera_serial": "C-2"}
    assert document == json.loads(plain.out)
