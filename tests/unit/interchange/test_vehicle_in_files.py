"""Which vehicle a calibration is of, in its file."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from calib_core.errors import InputError
from calib_core.interchange import CalibrationFile, VehicleNote, read_calibration, write_calibration

FULL = VehicleNote("V017", "van", "2026-09-21", "R-0417", "C-\u00fc12")


@pytest.fixture
def file(project_root: Path) -> CalibrationFile:
    return read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("note", [FULL, VehicleNote(radar_serial="R-1"), VehicleNote()])
def test_it_is_read_back_and_only_what_is_stated_is_written(file: CalibrationFile, note: VehicleNote) -> None:
    text = write_calibration(replace(file, vehicle=note))
    stated = {name: value for name in VehicleNote.__slots__ if (value := getattr(note, name)) is not None}
    assert json.loads(text).get("vehicle", {}) == stated
    assert ("vehicle" in json.loads(text)) == bool(stated)
    assert read_calibration(text).vehicle == note
    assert write_calibration(read_calibration(text)) == text


def test_what_a_later_version_adds_is_kept(file: CalibrationFile) -> None:
    document = json.loads(write_calibration(replace(file, vehicle=FULL)))
    document["vehicle"]["colour"] = "blue"
    again = json.loads(write_calibration(read_calibration(json.dumps(document))))
    assert again["vehicle"] == document["vehicle"]


@pytest.mark.parametrize("text", ["", "  ", "a\nb", "a\u202eb", "x" * 121])
def test_what_is_no_name_is_refused_with_its_place(file: CalibrationFile, text: str) -> None:
    document = json.loads(write_calibration(replace(file, vehicle=FULL)))
    document["vehicle"]["radar_serial"] = text
    with pytest.raises(InputError, match=r"file\.json: vehicle\.radar_serial is '.*'; give 1 to 120 printable"):
        read_calibration(json.dumps(document), "file.json")


def test_what_is_stated_anew_goes_before_what_a_file_says() -> None:
    assert VehicleNote(session="2026-10-01").over(FULL) == replace(FULL, session="2026-10-01")
