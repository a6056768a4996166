"""`check --of`: is a file that calibration's file, up to the digits written, and not stale?"""

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest

from calib_core.interchange import (
    FORMATS,
    CalibrationFile,
    CheckReport,
    FrameNames,
    check,
    choose_check_point,
    export,
    format_named,
    imported,
    read_any,
    read_calibration,
    write_calibration,
)
from calib_core.interchange.syntax.zip_archives import pack, unpack

NAMES = [known.name for known in FORMATS]
WITH_LENS = ("json", "opencv", "colmap", "matlab", "kalibr")
BINARY = ("matlab", "colmap")
UNROUNDABLE = ("matlab", "json", "driveworks", "pack")
"""Two that are binary, stated twice, in degrees, with check sums, and read as the product of two poses."""

NUMBER = re.compile(
    rb"-?(?!1\.57079)\d+\.\d{5,}(?:e-?\d+)?"
)  # but a right angle, which URDF's optical joint needs in full


@pytest.fixture(scope="module")
def file(project_root: Path) -> CalibrationFile:
    file = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    return dataclasses.replace(file, evidence="clicked")


def data_of(file: CalibrationFile, name: str) -> bytes:
    return export(file, name, rectified=format_named(name).is_for_rectified).data


def rounded(data: bytes, decimals: int, name: str) -> bytes:
    """Round every long number of the pose; comments, with the check point in them, stay as they are."""
    if data.startswith(b"PK"):
        return pack({member: rounded(one, decimals, "") for member, one in unpack(data, source="").items()})
    lines = re.sub(rb"<!--.*?-->", lambda comment: comment[0].replace(b"\n", b"\0"), data, flags=re.DOTALL).splitlines()
    short = [
        line
        if line.lstrip().startswith((b"#", b"<!--"))
        else NUMBER.sub(lambda number: repr(round(float(number[0]), decimals)).encode(), line)
        for line in lines
    ]
    return b"\n".join(short).replace(b"\0", b"\n")


def errors(report: CheckReport) -> set[str]:
    return {result.code for result in report.results if result.level == "error"}


@pytest.mark.parametrize("name", NAMES)
def test_what_we_write_is_that_calibrations_file(file, name):
    report = check(read_any(data_of(file, name)), of=imported(file), against=imported(file))

    assert report.verdict == "right"
    assert all(result.level == "good" for result in report.results)
    assert {"same-pose", "agrees"} <= {result.code for result in report.results}
    assert any("0 deg apart" in line for line in report.lines())
    assert "same-lens" in {result.code for result in report.results} or name not in ("json", "opencv")


@pytest.mark.parametrize("name", [name for name in NAMES if name not in UNROUNDABLE])
def test_rounding_is_named_with_its_digits(file, name):
    of = imported(file)
    fine, coarse = (read_any(rounded(data_of(file, name), decimals, name)) for decimals in (6, 3))

    assert check(fine, of=of).verdict == "right"
    report = check(coarse, of=of)
    assert errors(report) >= {"rounded"}
    assert errors(report) <= {"rounded", "other-lens"}
    assert "the numbers are rounded to" in str(report)


@pytest.mark.parametrize(
    "name", [known.name for known in FORMATS if known.comment in ("#", "<!-- -->") and known.name not in BINARY]
)
def test_a_rounded_file_is_named_by_its_own_check_point(file, name):
    turned = file.calibration.camera_from_radar.perturbed(np.array([0.31, 0.12, 0.53, 0.2, 0.3, -0.1]))
    calibration = dataclasses.replace(file.calibration, camera_from_radar=turned, pairs=())
    data = data_of(
        dataclasses.replace(file, calibration=calibration, check_point=choose_check_point(calibration)), name
    )

    assert check(read_any(rounded(data, 6, name))).verdict == "right"
    assert "rounded" in errors(check(read_any(rounded(data, 3, name))))


@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_another_calibration_is_named_and_stale(file, name):
    moved = dataclasses.replace(
        file.calibration,
        camera_from_radar=file.calibration.camera_from_radar.perturbed(np.array([0.002, 0, 0, 0, 1e-3, 0])),
        pairs=(),
    )
    other = dataclasses.replace(file, calibration=moved, check_point=None)

    report = check(read_any(data_of(other, name)), of=imported(file))

    assert report.verdict == "wrong"
    assert "other-pose" in errors(report)
    assert ("stale" in errors(report)) == (read_any(data_of(other, name)).calibration_sha256 is not None)
    if "stale" in errors(report):
        assert "stale: exported from another calibration than this one (sha256 " in str(report)


def test_a_stale_file_with_the_same_pose_is_a_warning(file):
    solved_again = dataclasses.replace(
        file, verdict=None, calibration=dataclasses.replace(file.calibration, warnings=())
    )
    assert write_calibration(solved_again) != write_calibration(file)

    report = check(read_any(data_of(file, "tf2")), of=imported(solved_again))

    assert report.ok
    assert [result.code for result in report.results if result.level == "warning"] == ["stale"]


@pytest.mark.parametrize("name", WITH_LENS)
def test_another_cameras_intrinsics_are_named(file, name):
    matrix_px = np.array(file.calibration.camera.matrix_px)
    matrix_px[0, 0] += 5.0
    camera = dataclasses.replace(file.calibration.camera, matrix_px=matrix_px)
    other = dataclasses.replace(file, calibration=dataclasses.replace(file.calibration, camera=camera, pairs=()))
    wrong = read_any(data_of(other, name))

    assert "other-lens" in errors(check(wrong, of=imported(file)))
    report = check(wrong, against=imported(dataclasses.replace(file, calibration=file.calibration)))
    assert report.comparison.lens.text.startswith("fx ")


def test_other_frame_names_are_named_unless_they_were_renamed_on_export(file):
    renamed = dataclasses.replace(file, frames=FrameNames("front_radar", "front_optical"))
    content = json.loads(write_calibration(file))
    content["frames"] = {"radar": "front_radar", "camera": "front_optical"}

    assert "other-frames" in errors(check(read_any(json.dumps(content)), of=imported(file)))
    assert "'front_radar'" in str(check(read_any(data_of(renamed, "tf2")), of=imported(file)))


def test_an_assumed_import_is_not_proven_by_its_own_check_point(file):
    assumed = dataclasses.replace(
        file, calibration=dataclasses.replace(file.calibration, pairs=()), evidence="imported_assumed"
    )

    report = check(imported(assumed))

    assert report.verdict == "unproven"
    assert "shows only that the file is whole" in str(report)
    assert check(read_any(data_of(assumed, "tf2"))).verdict == "unproven"
    assert check(imported(assumed), against=imported(file)).verdict == "right"
    proven = dataclasses.replace(assumed, evidence="imported_proven")
    assert check(imported(proven)).verdict == "right"


def test_an_implausible_pose_of_an_assumed_import_is_doubtful(file):
    inverse = dataclasses.replace(
        file.calibration, camera_from_radar=file.calibration.camera_from_radar.inverse(), pairs=()
    )
    assumed = dataclasses.replace(file, calibration=inverse, evidence="imported_assumed", check_point=None)

    assert check(imported(assumed)).verdict == "doubtful"


def test_assumptions_are_said_to_be_assumed(file):
    bare = b"".join(line for line in data_of(file, "kitti").splitlines(keepends=True) if b"cocalib" not in line)
    lines = check(read_any(bare)).lines()

    assert any(line.startswith("assumed: the format names no frames") for line in lines)
