"""The published schemas and the formats page match the code."""

import re
import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.interchange import (
    CAMERA_ONLY,
    FORMATS,
    Content,
    export,
    read_calibration,
    read_camera,
    read_clicks,
    read_pairs,
    write_calibration,
)
from calib_core.interchange.own.schemas import schema_texts
from calib_core.radar import AngleMap, RadarErrors


@pytest.mark.parametrize("name", ["clicks-1.schema.json", "pairs-1.schema.json", "calibration-1.schema.json"])
def test_the_published_schema_is_generated_from_the_types(project_root: Path, name):
    published = (project_root / "docs/schemas" / name).read_text(encoding="utf-8")

    assert published == schema_texts()[name], "run: python -m calib_core.interchange.own.schemas docs/schemas"


def test_the_page_lists_every_format_as_the_registry_has_it(project_root: Path):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    made = runpy.run_path(str(project_root / "docs/make_formats_table.py"))["with_table"](page)

    assert page == made, "run: python docs/make_formats_table.py"
    assert len(re.findall(r"^\| `[\w-]+` \|(?: [^|]+ \|){4}$", page, re.MULTILINE)) == len((*FORMATS, *CAMERA_ONLY))


def test_the_examples_on_the_page_are_read(project_root: Path):
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


def test_formats_are_named_once_and_each_notes_what_it_lacks(project_root: Path):
    names = [known.name for known in FORMATS]
    assert len(set(names)) == len(names)
    assert len({known.file_name for known in FORMATS}) == len(names)

    file = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    for known in FORMATS:
        notes = export(file, known.name, rectified=known.is_for_rectified).notes
        assert (known.camera == "none") == any("contains the pose only" in note for note in notes)
        assert known.comment != "none" or any("calibration.json" in note for note in notes)


def test_the_recipe_for_the_angle_map_gives_what_the_library_gives(
    project_root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    _, recipe, _ = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    golden = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    add = np.deg2rad(np.random.default_rng(2).uniform(-2, 2, (4, 6, 2)))
    angle_map = AngleMap(np.linspace(-0.5, 0.5, 6), np.linspace(-0.2, 0.1, 4), add, np.abs(add), 9.0, 5.0)
    (tmp_path / "calibration.json").write_text(
        write_calibration(replace(golden, calibration=replace(golden.calibration, angle_map=angle_map)))
    )
    monkeypatch.chdir(tmp_path)

    names: dict[str, Any] = {}
    exec(recipe, names)

    np.testing.assert_allclose(names["corrected"], angle_map.corrected(names["points"]), rtol=0, atol=1e-12)
    assert np.abs(names["corrected"] - names["points"]).max() > 0.01


def test_the_recipe_for_radar_errors_gives_what_the_library_gives(
    project_root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    recipe, _, _ = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    golden = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    monkeypatch.chdir(tmp_path)
    for errors in (RadarErrors(), RadarErrors(0.02, -0.03, 0.12, 0.6), RadarErrors(squared_height_m2=1e3)):
        calibration = replace(golden.calibration, radar_errors=errors)
        (tmp_path / "calibration.json").write_text(write_calibration(replace(golden, calibration=calibration)))
        names: dict[str, Any] = {}
        exec(recipe, names)
        np.testing.assert_allclose(names["true"], errors.corrected(names["reported"]), rtol=0, atol=1e-12)
        pixels_px = calibration.camera.project(names["points_camera"])
        np.testing.assert_allclose(pixels_px, calibration.reproject(names["reported"]), rtol=0, atol=1e-8)


def test_the_example_of_a_format_writes_and_reads(project_root: Path):
    page = (project_root / "docs/formats.md").read_text(encoding="utf-8")
    _, _, example = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    golden = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    names: dict[str, Any] = {}
    exec(example, names)
    acme = names["ACME_FORMAT"]
    text = acme.write(golden)
    content = Content("lines", text=text)
    assert acme.reads.recognizes(content)
    back = acme.reads.read(content, "acme.txt").camera_from_radar
    assert np.array_equal(back.as_matrix(), golden.calibration.camera_from_radar.as_matrix())
