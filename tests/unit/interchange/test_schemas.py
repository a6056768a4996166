"""The published schemas in an independent validator: they accept what we write and read, and refuse the rest."""

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from calib_core.interchange import read_calibration, write_calibration


@pytest.fixture
def faults(project_root: Path) -> Callable[[dict[str, Any]], list[str]]:
    def found(document: dict[str, Any]) -> list[str]:
        name = document["schema"].removeprefix("cocalib/")
        schema = json.loads((project_root / f"docs/schemas/{name}.schema.json").read_text(encoding="utf-8"))
        jsonschema.Draft202012Validator.check_schema(schema)
        return [error.message for error in jsonschema.Draft202012Validator(schema).iter_errors(document)]

    return found


@pytest.fixture
def golden(project_root: Path) -> dict[str, Any]:
    return json.loads((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))


def test_what_we_write_and_what_an_earlier_version_wrote_is_valid(project_root: Path, faults, golden):
    earlier = (project_root / "tests/golden/calibration-1-earlier.json").read_text(encoding="utf-8")

    assert faults(golden) == []
    assert faults(json.loads(earlier)) == []
    with_prior = (project_root / "tests/golden/calibration-1-fleet-prior.json").read_text(encoding="utf-8")
    assert faults(json.loads(with_prior)) == []
    assert faults(json.loads(write_calibration(read_calibration(earlier)))) == []


def test_the_examples_on_the_page_are_valid(project_root: Path, faults):
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

    assert any("'camera_from_radar' is a required property" in fault for fault in faults(golden))
    assert len(faults(golden)) > 1
