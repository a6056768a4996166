"""The published schemas and the formats page match the code, and the schemas hold in an independent validator."""

import copy
import json
import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from calib_core.interchange.cameras.files import read_camera
from calib_core.interchange.exporting import export
from calib_core.interchange.formats.registry import CAMERA_ONLY, FORMATS
from calib_core.interchange.own.calibration_json import read_calibration, write_calibration
from calib_core.interchange.own.clicks_json import read_clicks
from calib_core.interchange.own.pairs_files import read_pairs
from calib_core.radar import AngleMap, RadarErrors


def test_the_published_schemas_are_generated_from_the_types(project_root):
    published = {path.name: path.read_text(encoding="utf-8") for path in (project_root / "docs/schemas").iterdir()}
    made = runpy.run_path(str(project_root / "docs/make_schemas.py"))["schema_texts"]()

    assert published == made, "run: python docs/make_schemas.py"


def test_the_page_lists_every_format_as_the_registry_has_it(project_root):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    made = runpy.run_path(str(project_root / "docs/make_formats_table.py"))["with_table"](page)

    assert page == made, "run: python docs/make_formats_table.py"
    assert len(re.findall(r"^\| `[\w-]+` \|(?: [^|]+ \|){5}$", page, re.MULTILINE)) == len((*FORMATS, *CAMERA_ONLY))


def test_the_examples_on_the_page_are_read(project_root):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    examples = re.findall(r"```(json|yaml)\n(.*?)```", page, flags=re.DOTALL)
    readers = {"cocalib/clicks-1": read_clicks, "cocalib/pairs-1": read_pairs}

    read = []
    for language, text in examples:
        schema = re.search(r'"schema": "([\w/-]+)"', text)
        if schema:
            read.append(readers[schema[1]](text))
        else:
            read.append(read_camera(text, language))

    assert len(read) == 3


def test_formats_are_named_once_and_each_notes_what_it_lacks(file):
    names = [known.name for known in FORMATS]
    assert len(set(names)) == len(names)
    assert len({known.file_name for known in FORMATS}) == len(names)

    for known in FORMATS:
        notes = export(file, known.name, rectified=known.is_for_rectified).notes
        assert (known.camera == "none") == any("contains the pose only" in note for note in notes)
        assert known.comment != "none" or any("calibration.json" in note for note in notes)


def test_the_recipe_for_the_angle_map_gives_what_the_library_gives(file, project_root, tmp_path, monkeypatch):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    _, recipe = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    add = np.deg2rad(np.random.default_rng(2).uniform(-2, 2, (4, 6, 2)))
    angle_map = AngleMap(np.linspace(-0.5, 0.5, 6), np.linspace(-0.2, 0.1, 4), add, np.abs(add), 9.0, 5.0)
    (tmp_path / "calibration.json").write_text(
        write_calibration(replace(file, calibration=replace(file.calibration, angle_map=angle_map)))
    )
    monkeypatch.chdir(tmp_path)

    names: dict[str, Any] = {}
    exec(recipe, names)

    np.testing.assert_allclose(names["corrected"], angle_map.corrected(names["points"]), rtol=0, atol=1e-12)
    assert np.abs(names["corrected"] - names["points"]).max() > 0.01


def test_the_recipe_for_radar_errors_gives_what_the_library_gives(file, project_root, tmp_path, monkeypatch):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    recipe, _ = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    monkeypatch.chdir(tmp_path)
    for errors in (RadarErrors(), RadarErrors(0.02, -0.03, 0.12, 0.6), RadarErrors(squared_height_m2=1e3)):
        calibration = replace(file.calibration, radar_errors=errors)
        (tmp_path / "calibration.json").write_text(write_calibration(replace(file, calibration=calibration)))
        names: dict[str, Any] = {}
        exec(recipe, names)
        np.testing.assert_allclose(names["true"], errors.corrected(names["reported"]), rtol=0, atol=1e-12)
        pixels_px = calibration.camera.project(names["points_camera"])
        np.testing.assert_allclose(pixels_px, calibration.reproject(names["reported"]), rtol=0, atol=1e-8)


@pytest.fixture(scope="module")
def faults(project_root: Path) -> Callable[[dict[str, Any]], list[str]]:
    @cache
    def validator(name: str) -> jsonschema.Draft202012Validator:
        schema = json.loads((project_root / f"docs/schemas/{name}.schema.json").read_text(encoding="utf-8"))
        jsonschema.Draft202012Validator.check_schema(schema)
        return jsonschema.Draft202012Validator(schema)

    def found(document: dict[str, Any]) -> list[str]:
        return [error.message for error in validator(document["schema"].removeprefix("cocalib/")).iter_errors(document)]

    return found


@pytest.fixture
def golden(golden_text: str) -> dict[str, Any]:
    return json.loads(golden_text)


def test_what_we_write_is_valid(project_root, faults, golden):
    assert faults(golden) == []
    assert faults(json.loads(write_calibration(read_calibration(json.dumps(golden))))) == []


def test_the_examples_on_the_page_are_valid(project_root, faults):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    examples = [json.loads(text) for text in re.findall(r"```json\n(.*?)```", page, flags=re.DOTALL)]

    assert [faults(example) for example in examples if "schema" in example] == [[], []]


def test_a_result_may_grow_and_a_setting_may_not(faults, golden):
    grown = copy.deepcopy(golden)
    grown["metrics"]["weather"] = "rain"
    grown["new"] = [1]
    assert faults(grown) == []

    for settings in (("options",), ("options", "noise"), ("camera",)):
        changed = copy.deepcopy(golden)
        owner = changed
        for key in settings:
            owner = owner[key]
        owner["sigma_pixels"] = 1
        assert any("sigma_pixels" in fault for fault in faults(changed))


def test_a_missing_or_wrong_part_is_named(faults, golden):
    del golden["camera_from_radar"]
    golden["covariance"] = [[1, 2], [3, 4]]

    assert any("'camera_from_radar' is a required" in fault for fault in faults(golden))
    assert len(faults(golden)) > 1


# msgspec learns the types of our files when they are imported: two threads that did so at once crashed the process.
_LEARNT = """
import msgspec
learnt = []
decoder = msgspec.json.Decoder
msgspec.json.Decoder = lambda document: learnt.append(document.__name__) or decoder(document)
import calib_core.interchange.own.documents
print(*learnt)
"""


def test_the_types_of_our_files_are_learnt_when_they_are_imported():
    done = subprocess.run([sys.executable, "-c", _LEARNT], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["ClicksDocument", "PairsDocument", "CalibrationDocument"]
