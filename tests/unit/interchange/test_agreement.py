"""Two calibrations are compared each through its own lens, and judged by their covariances and by limits."""

import dataclasses
import json
import re
from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import preview_pairs
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import (
    CalibrationFile,
    FrameNames,
    Provenance,
    VehicleNote,
    choose_check_point,
)
from calib_core.interchange.check.agreement import AgreementLimits, compare
from calib_core.interchange.check.pair_residuals import read_check_pairs, read_check_pairs_file
from calib_core.interchange.check.report import CheckReport, check
from calib_core.interchange.exporting import export
from calib_core.interchange.format import ImportedCalibration, imported
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import adoption, read_any
from calib_core.interchange.own.calibration_json import write_calibration
from calib_core.interchange.syntax.zip_archives import pack, unpack
from calib_core.synthetic.rig import random_rig


def moved(file: CalibrationFile, *error: float) -> CalibrationFile:
    """Return it with an error of its pose, (dt, dtheta) [m, rad], and without the pairs, which would no longer fit."""
    calibration = dataclasses.replace(
        file.calibration,
        camera_from_radar=file.calibration.camera_from_radar.perturbed(np.array(error or (0.0,) * 6)),
        pairs=(),
    )
    return dataclasses.replace(file, calibration=calibration, check_point=None, evidence="clicked")


def seen_by(file: CalibrationFile, camera: Camera) -> CalibrationFile:
    return dataclasses.replace(file, calibration=dataclasses.replace(file.calibration, camera=camera))


def longer_focal_length(camera: Camera, factor: float) -> Camera:
    matrix_px = np.array(camera.matrix_px)
    matrix_px[:2, :2] *= factor
    return dataclasses.replace(camera, matrix_px=matrix_px)


def bare(file: CalibrationFile) -> ImportedCalibration:
    """Return it as a format with nothing but the pose."""
    pose = file.calibration.camera_from_radar
    return read_any("\n".join(" ".join(map(repr, row)) for row in pose.as_matrix().tolist()))


def error_codes(report) -> list[str]:
    return [result.code for result in report.results if result.level == "error"]


def test_a_difference_far_beyond_the_covariances_is_no_agreement(file):
    report = check(imported(moved(file, 0, 0, 0, 0, np.radians(9.4), 0)), against=imported(file))

    assert error_codes(report) == ["disagrees"]
    assert report.verdict == "wrong"
    assert report.comparison.change.squared > 1000
    assert any(line.startswith("DIFFERS: 9.4 deg") and "chi2" in line for line in report.lines())


def test_a_difference_within_the_covariances_is_agreement(file):
    report = check(imported(moved(file, 0.005, 0, 0, 0, 1e-3, 0)), against=imported(file))

    assert report.verdict == "right"
    assert report.judgement.significant is False
    assert [one.name for one in report.judgement.criteria] == ["chi2"]


def test_without_a_covariance_the_usual_limits_decide_and_are_stated(file):
    near = check(bare(moved(file, 0.01, 0, 0, 0, 0.002, 0)), against=bare(file))
    far = check(bare(moved(file, 0.01, 0, 0, 0, np.radians(1.2), 0)), against=bare(file))

    assert (near.verdict, far.verdict) == ("right", "wrong")
    assert all("usual limits" in str(report) and "1 deg" in str(report) for report in (near, far))


def test_limits_given_replace_the_test_and_a_significant_difference_is_said(file):
    other = imported(moved(file, 0, 0, 0, 0, 0.02, 0))

    assert check(other, against=imported(file)).verdict == "wrong"
    passed = check(other, against=imported(file), limits=AgreementLimits(max_deg=2.0, max_cm=5.0))
    assert passed.verdict == "right"
    assert "but within the limits" in str(passed)


@pytest.mark.parametrize(
    "limits",
    [
        AgreementLimits(max_deg=0.5),
        AgreementLimits(max_cm=1.0),
        AgreementLimits(max_px=3.0),
        AgreementLimits(max_sigma=3.0),
    ],
)
def test_each_limit_alone_finds_the_difference(file, limits):
    other = imported(moved(file, 0.05, 0, 0, 0, 0.02, 0))

    report = check(other, against=imported(file), limits=limits)

    assert error_codes(report) == ["disagrees"]
    (name,) = {one.name for one in report.judgement.criteria if not one.met}
    assert getattr(limits, f"max_{name}") is not None


def test_a_limit_that_cannot_be_tested_is_refused(file):
    with pytest.raises(InputError, match="--max-sigma needs a covariance"):
        check(bare(file), against=bare(file), limits=AgreementLimits(max_sigma=3.0))
    with pytest.raises(InputError, match=r"--max-px needs the intrinsics.*--camera FILE"):
        check(bare(file), against=bare(file), limits=AgreementLimits(max_px=3.0))
    with pytest.raises(InputError, match="--max-deg -1: a limit is a number of at least 0"):
        AgreementLimits(max_deg=-1.0)


def test_standard_deviations_are_those_of_one_normal_variable(file):
    from scipy.stats import norm

    both = compare(imported(file), imported(moved(file, 0.01, 0, 0, 0, 2e-3, 0)))
    far = compare(imported(file), imported(moved(file, 0, 0, 0, 0, 1.0, 0)))

    assert 2 * norm.sf(both.change.sigmas) == pytest.approx(both.change.p_value)
    assert far.change.p_value < 1e-12
    assert 7 < far.change.sigmas < np.sqrt(far.change.squared)


def test_a_larger_quantile_makes_the_test_more_patient(file):
    other = imported(moved(file, 0, 0, 0, 0, 0.008, 0))
    strict = compare(imported(file), other)
    patient = dataclasses.replace(
        file, calibration=dataclasses.replace(file.calibration, covariance_quantile=4 * strict.change.limit(0.05))
    )

    report = check(other, against=imported(patient))

    assert check(other, against=imported(file)).verdict == "wrong"
    assert report.verdict == "right"
    assert report.comparison.change.p_value > 0.05 > strict.change.p_value


def test_which_of_the_two_is_the_first_changes_no_figure(file):
    wide = seen_by(moved(file, 0.3, 0, 0.2, 0.1, 0.2, 0), longer_focal_length(file.calibration.camera, 1.1))
    one, other = compare(imported(file), imported(wide)), compare(imported(wide), imported(file))

    for at, back in zip(one.pixels, other.pixels, strict=True):
        assert dataclasses.astuple(at) == pytest.approx(dataclasses.astuple(back), rel=1e-9)
    assert one.change.squared == pytest.approx(other.change.squared, rel=1e-9)


@pytest.fixture(scope="module")
def twice(file) -> tuple[CalibrationFile, CalibrationFile]:
    """Return two calibrations of one rig, each from pairs of its own."""
    rig = random_rig(np.random.default_rng(5), camera=file.calibration.camera)
    solved = [
        preview_pairs(drawn.pairs, drawn.camera).unwrap()
        for drawn in (simulate_pairs(20, rng=np.random.default_rng(k), noise="imaging", rig=rig) for k in (1, 2))
    ]
    return CalibrationFile(solved[0]), CalibrationFile(solved[1])


def test_errors_cancel_between_calibrations_of_the_same_sensors_only(twice):
    first, second = twice
    two = Provenance(radar_topic="/radar", radar_topics=("/radar",))
    other_lens = seen_by(second, longer_focal_length(second.calibration.camera, 1.001))
    same = compare(imported(first), imported(second))
    forced = compare(imported(first), imported(other_lens), same_sensors=True, same_person=True)

    assert (same.shared, same.unshared) == (("radar", "lens"), "")
    assert forced.shared == ("radar", "clicks")
    assert "detectable change" in same.verdict
    for other, reason in (
        (dataclasses.replace(second, vehicle=VehicleNote(radar_serial="7")), "other serials"),
        (dataclasses.replace(second, provenance=two), "other topics"),
        (other_lens, "other intrinsics"),
    ):
        apart = compare(imported(first), imported(other))
        assert apart.shared == ()
        assert reason in apart.unshared
        assert "--same-sensors" in apart.unshared
        assert (apart.change.noticeable(0.05) > same.change.noticeable(0.05)).all()


def test_files_without_pairs_are_compared_with_every_error_counted_twice(twice):
    silent = dataclasses.replace(twice[1], calibration=dataclasses.replace(twice[1].calibration, pairs=()))
    report = check(imported(silent), against=imported(twice[0]))

    assert "counts as independent" in str(report)
    assert "detectable change" in str(report)
    assert report.verdict == "right"


def test_the_power_is_that_of_the_level_that_was_asked_for(twice):
    plain, strict = (
        check(imported(twice[1]), against=imported(twice[0]), limits=AgreementLimits(max_sigma=sigma)).judgement.noticed
        for sigma in (1.96, 3.29)
    )
    noticed_deg = [float(text.split(": ")[1].split()[0]) for text in (plain, strict)]

    assert noticed_deg[1] > 1.1 * noticed_deg[0]
    assert check(imported(twice[1]), against=imported(twice[0])).judgement.noticed == plain
    assert not check(
        imported(twice[1]), against=imported(twice[0]), limits=AgreementLimits(max_deg=2.0)
    ).judgement.noticed


def test_another_lens_is_found_and_named_with_its_part_of_the_difference(file):
    wide = longer_focal_length(file.calibration.camera, 1.1)
    report = check(imported(seen_by(file, wide)), against=imported(file))

    assert "other-lens" in error_codes(report)
    assert report.comparison.rotation_deg == pytest.approx(0, abs=1e-9)
    at = report.comparison.pixels[1]
    assert at.rms_px > 5
    assert at.pose_rms_px == pytest.approx(0, abs=1e-6)
    assert report.comparison.lens.rms_px == pytest.approx(at.rms_px, rel=0.05)
    assert "by the lens alone" in str(report)
    assert "fx " in str(report)
    assert "0 px rms by" in str(report)


def test_images_of_another_size_are_another_camera(file):
    camera = file.calibration.camera
    double = Camera(camera.model, 2 * camera.width_px, camera.height_px, camera.matrix_px, camera.distortion)

    report = check(imported(seen_by(file, double)), against=imported(file))

    assert "other-lens" in error_codes(report)
    assert f"images of {camera.width_px} x {camera.height_px} px and of {2 * camera.width_px} x" in str(report)


def test_a_limit_in_pixels_applies_to_the_lens(file):
    other = imported(seen_by(moved(file), longer_focal_length(file.calibration.camera, 1.02)))

    assert check(other, against=imported(file), limits=AgreementLimits(max_px=20.0)).verdict == "right"
    assert check(other, against=imported(file), limits=AgreementLimits(max_px=0.5)).verdict == "wrong"


def test_pairs_seen_by_another_camera_are_named(file):
    pairs = read_check_pairs(write_calibration(file))
    other = imported(seen_by(file, longer_focal_length(file.calibration.camera, 1.1)))

    report = check(other, pairs=pairs)

    found = next(result for result in report.results if result.code == "other-lens")
    assert found.level == "error"
    assert "by the lens alone" in found.message
    assert "by the pose alone" in found.message
    assert not any(result.code == "other-lens" for result in check(imported(file), pairs=pairs).results)


@pytest.mark.parametrize("name", ["kitti", "nuscenes"])
def test_the_matrix_of_our_rectified_images_is_that_of_the_same_camera(file, name):
    written = read_any(export(file, name).data)
    k_px = np.array(written.matrix_px)
    assert abs(k_px[0, 0] - file.calibration.camera.matrix_px[0, 0]) > 20

    for limits in (AgreementLimits(), AgreementLimits(max_px=2.0)):
        report = check(written, against=imported(file), limits=limits)
        assert report.verdict == "right"
        assert "other-lens" not in str(report.results)
    k_px[0, 0] *= 1.2
    other = dataclasses.replace(written, matrix_px=k_px, check_point=None)
    assert check(other, against=imported(file), limits=AgreementLimits(max_px=2.0)).verdict == "wrong"


def test_points_behind_the_other_camera_are_said_to_be_there(file):
    behind = imported(moved(file, 0, 0, 0, 0, np.pi, 0))

    report = check(behind, against=imported(file))

    assert "behind the camera" in str(report)
    assert "inf" not in str(report)
    assert "e+1" not in str(report)


# `check --of`: is a file that calibration's file, up to the digits written, and not stale?


NAMES = [known.name for known in FORMATS]
WITH_LENS = ("json", "opencv", "colmap", "matlab", "kalibr")
BINARY = ("matlab", "colmap")
UNROUNDABLE = ("matlab", "json", "driveworks")
"""One that is binary, one stated twice, and one in degrees that is read as the product of two poses."""

NUMBER = re.compile(
    rb"-?(?!1\.57079)\d+\.\d{5,}(?:e-?\d+)?"
)  # but a right angle, which URDF's optical joint needs in full


@pytest.fixture(scope="module")
def clicked(file: CalibrationFile) -> CalibrationFile:
    return dataclasses.replace(file, evidence="clicked")


def data_of(clicked: CalibrationFile, name: str) -> bytes:
    return export(clicked, name, rectified=format_named(name).is_for_rectified).data


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
def test_what_we_write_is_that_calibrations_file(clicked, name):
    report = check(read_any(data_of(clicked, name)), of=imported(clicked), against=imported(clicked))

    assert report.verdict == "right"
    assert all(result.level == "good" for result in report.results)
    assert {"same-pose", "agrees"} <= {result.code for result in report.results}
    assert any("0 deg apart" in line for line in report.lines())
    assert "same-lens" in {result.code for result in report.results} or name not in ("json", "opencv")


@pytest.mark.parametrize("name", [name for name in NAMES if name not in UNROUNDABLE])
def test_rounding_is_named_with_its_digits(clicked, name):
    of = imported(clicked)
    fine, coarse = (read_any(rounded(data_of(clicked, name), decimals, name)) for decimals in (6, 3))

    assert check(fine, of=of).verdict == "right"
    report = check(coarse, of=of)
    assert errors(report) >= {"rounded"}
    assert errors(report) <= {"rounded", "other-lens"}
    assert "rounded to" in str(report)


@pytest.mark.parametrize(
    "name", [known.name for known in FORMATS if known.comment in ("#", "<!-- -->") and known.name not in BINARY]
)
def test_a_rounded_file_is_named_by_its_own_check_point(clicked, name):
    turned = clicked.calibration.camera_from_radar.perturbed(np.array([0.31, 0.12, 0.53, 0.2, 0.3, -0.1]))
    calibration = dataclasses.replace(clicked.calibration, camera_from_radar=turned, pairs=())
    data = data_of(
        dataclasses.replace(clicked, calibration=calibration, check_point=choose_check_point(calibration)), name
    )

    assert check(read_any(rounded(data, 6, name))).verdict == "right"
    assert "rounded" in errors(check(read_any(rounded(data, 3, name))))


@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_another_calibration_is_named_and_stale(clicked, name):
    moved = dataclasses.replace(
        clicked.calibration,
        camera_from_radar=clicked.calibration.camera_from_radar.perturbed(np.array([0.002, 0, 0, 0, 1e-3, 0])),
        pairs=(),
    )
    other = dataclasses.replace(clicked, calibration=moved, check_point=None)

    report = check(read_any(data_of(other, name)), of=imported(clicked))

    assert report.verdict == "wrong"
    assert "other-pose" in errors(report)
    assert ("stale" in errors(report)) == (read_any(data_of(other, name)).calibration_sha256 is not None)
    if "stale" in errors(report):
        assert "stale: exported from another" in str(report)


def test_a_stale_file_with_the_same_pose_is_a_warning(clicked):
    solved_again = dataclasses.replace(
        clicked, verdict=None, calibration=dataclasses.replace(clicked.calibration, warnings=())
    )
    assert write_calibration(solved_again) != write_calibration(clicked)

    report = check(read_any(data_of(clicked, "tf2")), of=imported(solved_again))

    assert report.ok
    assert [result.code for result in report.results if result.level == "warning"] == ["stale"]


@pytest.mark.parametrize("name", WITH_LENS)
def test_another_cameras_intrinsics_are_named(clicked, name):
    matrix_px = np.array(clicked.calibration.camera.matrix_px)
    matrix_px[0, 0] += 5.0
    camera = dataclasses.replace(clicked.calibration.camera, matrix_px=matrix_px)
    other = dataclasses.replace(clicked, calibration=dataclasses.replace(clicked.calibration, camera=camera, pairs=()))
    wrong = read_any(data_of(other, name))

    assert "other-lens" in errors(check(wrong, of=imported(clicked)))
    report = check(wrong, against=imported(dataclasses.replace(clicked, calibration=clicked.calibration)))
    assert report.comparison.lens.text.startswith("fx ")


def test_other_frame_names_are_named_unless_they_were_renamed_on_export(clicked):
    renamed = dataclasses.replace(clicked, frames=FrameNames("front_radar", "front_optical"))
    content = json.loads(write_calibration(clicked))
    content["frames"] = {"radar": "front_radar", "camera": "front_optical"}

    assert "other-frames" in errors(check(read_any(json.dumps(content)), of=imported(clicked)))
    assert "'front_radar'" in str(check(read_any(data_of(renamed, "tf2")), of=imported(clicked)))


def test_an_assumed_import_is_not_proven_by_its_own_check_point(clicked):
    assumed = dataclasses.replace(
        clicked, calibration=dataclasses.replace(clicked.calibration, pairs=()), evidence="imported_assumed"
    )

    report = check(imported(assumed))

    assert report.verdict == "unproven"
    assert "the file is whole" in str(report)
    assert check(read_any(data_of(assumed, "tf2"))).verdict == "unproven"
    assert check(imported(assumed), against=imported(clicked)).verdict == "right"
    proven = dataclasses.replace(assumed, evidence="imported_proven")
    assert check(imported(proven)).verdict == "right"


def test_an_implausible_pose_of_an_assumed_import_is_doubtful(clicked):
    inverse = dataclasses.replace(
        clicked.calibration, camera_from_radar=clicked.calibration.camera_from_radar.inverse(), pairs=()
    )
    assumed = dataclasses.replace(clicked, calibration=inverse, evidence="imported_assumed", check_point=None)

    assert check(imported(assumed)).verdict == "doubtful"


def test_assumptions_are_said_to_be_assumed(clicked):
    bare = b"".join(line for line in data_of(clicked, "kitti").splitlines(keepends=True) if b"cocalib" not in line)
    lines = check(read_any(bare)).lines()

    assert any(line.startswith("assumed: ") and "no frames" in line for line in lines)


# A bare matrix is tested against data from outside the file: pairs, and the ground truth of a simulation.


@pytest.fixture
def pairs(file: CalibrationFile) -> Callable[[int], str]:
    """Return a function that writes pairs-1 with a given number of exact pairs."""

    def written(count: int) -> str:
        rng = np.random.default_rng(8)
        points = np.column_stack([rng.uniform(4, 15, 40), rng.uniform(-0.3, 0.3, 40), rng.uniform(-0.2, 0.1, 40)])
        points[:, 1:] *= points[:, :1]
        camera = file.calibration.camera
        rows = [
            {"id": f"p{i}", "radar_m": point.tolist(), "pixel_px": pixel.tolist()}
            for i, (point, pixel) in enumerate(zip(points, file.calibration.reproject(points), strict=True))
        ]
        described = {
            "model": camera.model,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "matrix_px": camera.matrix_px.tolist(),
            "distortion": camera.distortion.tolist(),
        }
        return json.dumps({"schema": "cocalib/pairs-1", "camera": described, "pairs": rows[:count]})

    return written


def matrix_text(matrix: np.ndarray) -> str:
    return "\n".join(" ".join(map(repr, row)) for row in matrix.tolist())


def test_pairs_confirm_a_bare_matrix_or_name_its_slip(file, pairs):
    right = file.calibration.camera_from_radar.as_matrix()
    millimetres = right.copy()
    millimetres[:3, 3] *= 1000
    transposed = right.copy()
    transposed[:3, :3] = right[:3, :3].T
    check_pairs = read_check_pairs(pairs(12))

    for matrix, codes, verdict in (
        (right, ["pairs-fit"], "right"),
        (np.linalg.inv(right), ["swapped-direction"], "wrong"),
        (millimetres, ["millimetres"], "wrong"),
        (transposed, ["transposed-rotation"], "wrong"),
    ):
        report = check(read_any(matrix_text(matrix)), pairs=check_pairs)
        assert [result.code for result in report.results] == codes
        assert report.verdict == verdict


def test_pairs_of_other_sensors_disagree_without_a_slip(file, pairs):
    moved = file.calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0.1, 0.4, 0])).as_matrix()

    report = check(read_any(matrix_text(moved)), pairs=read_check_pairs(pairs(12)))

    assert [result.code for result in report.results] == ["pairs-missed"]
    assert report.verdict == "wrong"


def test_the_pairs_of_a_calibration_serve_as_well(file, golden_text, tmp_path):
    document = json.loads(golden_text)
    document["pairs"] = document["pairs"] * 2
    for index, pair in enumerate(document["pairs"]):
        document["pairs"][index] = {**pair, "id": f"p{index}"}
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    matrix = np.linalg.inv(file.calibration.camera_from_radar.as_matrix())

    report = check(read_any(matrix_text(matrix)), pairs=read_check_pairs_file(path))

    assert [result.code for result in report.results] == ["swapped-direction"]


def test_too_few_pairs_and_files_of_something_else_are_refused(pairs, tmp_path):
    with pytest.raises(InputError, match="contains 3 pairs; a check needs at least 4"):
        read_check_pairs(pairs(3))
    with pytest.raises(InputError, match="this is a cocalib/clicks-1 file, not cocalib/pairs-1"):
        read_check_pairs('{"schema": "cocalib/clicks-1", "clicks": []}')
    with pytest.raises(InputError, match="no such file or folder"):
        read_check_pairs_file(tmp_path / "absent.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="not a text file"):
        read_check_pairs_file(tmp_path / "binary.json")


def test_with_nothing_to_test_it_against_a_bare_matrix_is_unproven_and_a_sideways_one_doubtful(file):
    right = file.calibration.camera_from_radar.as_matrix()

    plausible, sideways = (check(read_any(matrix_text(matrix))) for matrix in (right, np.linalg.inv(right)))

    assert (plausible.verdict, sideways.verdict) == ("unproven", "doubtful")
    assert plausible.lines()[-1].startswith("not proven: ")
    assert sideways.lines()[-1].startswith("DOUBTFUL: ")
    assert all("--pairs FILE" in report.lines()[-1] for report in (plausible, sideways))


def test_a_calibration_is_compared_with_the_truth_of_a_simulation_which_is_not_imported(file):
    truth = json.dumps(
        {
            "schema": "cocalib/truth-1",
            "camera_from_radar": {
                "rotation": file.calibration.camera_from_radar.rotation.tolist(),
                "translation_m": file.calibration.camera_from_radar.translation_m.tolist(),
            },
            "camera": {
                "model": file.calibration.camera.model,
                "width_px": file.calibration.camera.width_px,
                "height_px": file.calibration.camera.height_px,
                "matrix_px": file.calibration.camera.matrix_px.tolist(),
                "distortion": file.calibration.camera.distortion.tolist(),
            },
        }
    )

    report = check(imported(file), against=read_any(truth))

    assert report.verdict == "right"
    assert report.comparison.rotation_deg == pytest.approx(0, abs=1e-9)
    with pytest.raises(InputError, match="is the ground truth of a simulation"):
        adoption(read_any(truth), "truth.json")
    with pytest.raises(InputError, match=r"camera_from_radar\.rotation: missing"):
        read_any('{"schema": "cocalib/truth-1"}')
