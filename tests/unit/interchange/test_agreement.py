"""Two calibrations are compared each through its own lens, and judged by their covariances and by limits."""

import dataclasses

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import (
    AgreementLimits,
    CalibrationFile,
    ImportedCalibration,
    check,
    compare,
    export,
    imported,
    read_any,
    read_check_pairs,
    write_calibration,
)


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
    assert report.comparison.chi2 > 1000
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
    assert "significant under the covariances, but within the limits" in str(passed)


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

    assert 2 * norm.sf(both.sigmas) == pytest.approx(both.p_value)
    assert far.p_value == 0.0
    assert np.sqrt(far.chi2) - 1 < far.sigmas < np.sqrt(far.chi2)


def test_a_larger_quantile_makes_the_test_more_patient(file):
    other = imported(moved(file, 0, 0, 0, 0, 0.008, 0))
    strict = compare(imported(file), other)
    patient = dataclasses.replace(
        file, calibration=dataclasses.replace(file.calibration, covariance_quantile=4 * strict.chi2_limit)
    )

    report = check(other, against=imported(patient))

    assert check(other, against=imported(file)).verdict == "wrong"
    assert report.verdict == "right"
    assert report.comparison.p_value > 0.05 > strict.p_value


def test_another_lens_is_found_and_named_with_its_part_of_the_difference(file):
    wide = longer_focal_length(file.calibration.camera, 1.1)
    report = check(imported(seen_by(file, wide)), against=imported(file))

    assert "other-lens" in error_codes(report)
    assert report.comparison.rotation_deg == pytest.approx(0, abs=1e-9)
    at = report.comparison.pixels[1]
    assert at.rms_px > 5
    assert at.pose_rms_px == pytest.approx(0, abs=1e-6)
    assert report.comparison.lens.rms_px == pytest.approx(at.rms_px, rel=1e-6)
    assert "by the lens alone" in str(report)
    assert "fx " in str(report)
    assert "0 px rms by the pose alone" in str(report)


def test_pictures_of_another_size_are_another_camera(file):
    camera = file.calibration.camera
    double = Camera(camera.model, 2 * camera.width_px, camera.height_px, camera.matrix_px, camera.distortion)

    report = check(imported(seen_by(file, double)), against=imported(file))

    assert "other-lens" in error_codes(report)
    assert f"pictures of {camera.width_px} x {camera.height_px} px and of {2 * camera.width_px} x" in str(report)


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


def test_the_matrix_of_another_camera_in_a_file_of_rectified_pictures_is_seen(file):
    text = export(file, "kitti", rectified=True).data.decode()
    fx = repr(float(file.calibration.camera.matrix_px[0, 0]))

    report = check(read_any(text.replace(fx, repr(float(fx) * 1.2))), against=imported(file))

    assert any("fx" in result.message for result in report.results if result.code == "other-lens")
    assert check(read_any(text), against=imported(file)).results[-1].code == "agrees"


def test_points_behind_the_other_camera_are_said_to_be_there(file):
    behind = imported(moved(file, 0, 0, 0, 0, np.pi, 0))

    report = check(behind, against=imported(file))

    assert "behind the camera" in str(report)
    assert "inf" not in str(report)
    assert "e+1" not in str(report)
