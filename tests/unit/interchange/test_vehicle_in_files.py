"""Which vehicle a calibration is of, in its file."""

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

import calib_core as cc
from calib_core.errors import InputError
from calib_core.interchange import (
    CalibrationFile,
    VehicleNote,
    adopt,
    export,
    read_any,
    read_calibration,
    write_calibration,
)
from calib_core.interchange.calibration_file import MOST_CHARACTERS

FULL = VehicleNote("V017", "van", "2026-09-21", "R-0417", "C-\u00fc12")
KEYS = [one.name for one in fields(VehicleNote)]
GOLDEN = (Path(__file__).resolve().parents[2] / "golden/calibration-1.json").read_text(encoding="utf-8")

_LABELS = st.text(st.characters(exclude_categories=("C", "Z")), min_size=1, max_size=MOST_CHARACTERS)
_NAMES = _LABELS.filter(lambda text: text.strip(".") and not set(text) & set("/\\"))
_NOTES = st.builds(
    VehicleNote, **{key: st.none() | (_NAMES if key in ("name", "session") else _LABELS) for key in KEYS}
)


def with_vehicle(vehicle: object) -> str:
    return json.dumps({**json.loads(GOLDEN), "vehicle": vehicle})


@given(_NOTES, _NOTES)
def test_any_note_is_read_back_and_goes_before_what_a_file_says(one: VehicleNote, other: VehicleNote) -> None:
    text = write_calibration(replace(read_calibration(GOLDEN), vehicle=one))
    stated = {key: value for key in KEYS if (value := getattr(one, key)) is not None}
    assert json.loads(text).get("vehicle", {}) == stated
    assert ("vehicle" in json.loads(text)) == bool(stated)
    assert read_calibration(text).vehicle == one
    assert write_calibration(read_calibration(text)) == text
    both = one.over(other)
    assert all(getattr(both, key) == (getattr(one, key) or getattr(other, key)) for key in KEYS)


def test_a_file_of_which_nothing_is_stated_stays_as_it_is(project_root: Path) -> None:
    assert write_calibration(read_calibration(GOLDEN)) == GOLDEN
    assert write_calibration(read_calibration(with_vehicle({}))) == GOLDEN
    earlier = (project_root / "tests/golden/calibration-1-earlier.json").read_text(encoding="utf-8")
    assert read_calibration(earlier).vehicle == VehicleNote()
    assert "vehicle" not in json.loads(write_calibration(read_calibration(earlier)))


@pytest.mark.parametrize("vehicle", [{"plate": "F-17"}, {"name": "V017", "plate": "F-17"}])
def test_what_a_later_version_states_is_kept(vehicle: dict[str, str]) -> None:
    text = write_calibration(read_calibration(with_vehicle(vehicle)))
    assert json.loads(text)["vehicle"] == vehicle
    assert write_calibration(read_calibration(text)) == text


@pytest.mark.parametrize(
    ("vehicle", "fault"),
    [
        ("V017", "vehicle: expected object | null, got str"),
        ({"name": 17}, "vehicle.name: expected str | null, got int"),
        ({"name": ""}, "vehicle.name is ''; give 1 to 120 printable characters"),
        ({"radar_serial": "a\u202eb"}, "vehicle.radar_serial is 'a\\u202eb'; give 1 to 120 printable characters"),
        ({"name": "a/b"}, "vehicle.name: 'a/b' cannot be a name; give one without slashes"),
        ({"session": ".."}, "vehicle.session: '..' cannot be a name; give one without slashes"),
    ],
)
def test_an_invalid_value_is_refused_by_every_reader(vehicle: object, fault: str) -> None:
    for read in (read_calibration, read_any):
        with pytest.raises(InputError) as error:
            read(with_vehicle(vehicle), "mine.json")
        assert str(error.value).startswith(f"mine.json: {fault}")


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("value", ["", " ", "x" * 121, "a\x00", "\ud800"])
def test_a_note_that_no_file_can_hold_cannot_be_made(key: str, value: str) -> None:
    with pytest.raises(InputError, match=rf"^vehicle\.{key} is "):
        VehicleNote(**{key: value})
    assert getattr(VehicleNote(**{key: "x" * 120}), key) == "x" * 120


def test_exports_that_hold_the_calibration_keep_it(file: CalibrationFile) -> None:
    stated = replace(file, vehicle=FULL)
    assert export(stated, "json").content == write_calibration(stated)
    for name in ("json", "pack"):
        written = export(stated, name)
        assert adopt(read_any(written.data, written.file_name), written.file_name).vehicle == FULL


def test_a_script_states_it_too(file: CalibrationFile, tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    note = cc.VehicleNote(name="V017", radar_serial="R-0417")
    cc.write_calibration(path, file.calibration, vehicle=note)
    assert json.loads(path.read_text())["vehicle"] == {"name": "V017", "radar_serial": "R-0417"}
    assert cc.read_calibration(path).vehicle == note


def test_the_schema_says_the_same(file: CalibrationFile, project_root: Path) -> None:
    path = project_root / "docs/schemas/calibration-1.schema.json"
    schema: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(schema)
    assert validator.is_valid(json.loads(write_calibration(replace(file, vehicle=FULL))))
    assert validator.is_valid(json.loads(with_vehicle({"plate": "F-17"})))
    for wrong in ("V017", {"name": ""}, {"type": "x" * 121}, {"session": 3}):
        assert not validator.is_valid(json.loads(with_vehicle(wrong)))
