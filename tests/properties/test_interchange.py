"""Laws of the files: what is written reads back, the same input gives the same bytes, and bad input is only ever refused."""

import json
import math
import string
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, choose_check_point
from calib_core.interchange.cameras.files import read_camera
from calib_core.interchange.check.report import check
from calib_core.interchange.exporting import export
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration, write_calibration
from calib_core.interchange.own.clicks_json import read_clicks, write_clicks
from calib_core.interchange.own.pairs_files import read_pairs
from calib_core.interchange.rotations import matrix_from_rpy, rpy_from_matrix
from calib_core.interchange.syntax.strict_json import json_text
from calib_core.interchange.syntax.yaml_text import number_text
from calib_core.measurements import ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.parsing import yaml_documents
from calib_core.results import Calibration, Metrics, PairResult

COMPONENT = st.floats(-1.0, 1.0).map(lambda x: round(x, 6))
DISTANCE_M = st.floats(-5.0, 5.0, allow_subnormal=False)
FINITE = st.floats(-1e4, 1e4, allow_subnormal=False)
CAMERA = Camera("pinhole", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))
NAME = st.text(string.ascii_letters + string.digits + "_/-. ;|#:*{}[]()=!?äé漢", min_size=1, max_size=20)


@st.composite
def poses(draw: st.DrawFn) -> RigidTransform:
    quaternion = np.array([draw(COMPONENT) for _ in range(4)])
    assume(np.linalg.norm(quaternion) > 0.05)
    return RigidTransform(matrix_from_quaternion_wxyz(quaternion), [draw(DISTANCE_M) for _ in range(3)])


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    model = draw(st.sampled_from(["pinhole", "plumb_bob", "rational_polynomial", "equidistant"]))
    count = {"pinhole": 0, "plumb_bob": draw(st.sampled_from([4, 5])), "rational_polynomial": 8, "equidistant": 4}[
        model
    ]
    matrix = [
        [draw(st.floats(200, 2000)), 0, draw(st.floats(300, 340))],
        [0, draw(st.floats(200, 2000)), 240.5],
        [0, 0, 1],
    ]
    return Camera(model, 640, 480, np.array(matrix), np.array([draw(st.floats(-0.01, 0.01)) for _ in range(count)]))


@st.composite
def frame_names(draw: st.DrawFn) -> FrameNames:
    try:
        return FrameNames(draw(NAME), draw(NAME))
    except InputError:
        assume(False)
        raise


def file_of(pose: RigidTransform, camera: Camera, frames: FrameNames | None = None) -> CalibrationFile:
    calibration = Calibration(pose, np.full((6, 6), np.nan), camera, Metrics(), (), (), (), CalibrationOptions())
    return CalibrationFile(calibration, frames or FrameNames(), choose_check_point(calibration))


def refusal(read: Callable[..., object], *given: object) -> str:
    """Return the message with which an input is refused; empty if it is not."""
    try:
        read(*given)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("name", [known.name for known in FORMATS])
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(pose=poses(), camera=cameras(), frames=frame_names())
@example(pose=RigidTransform.identity(), camera=CAMERA, frames=FrameNames("two  spaces", "radar   or not"))
@example(pose=RigidTransform.identity(), camera=CAMERA, frames=FrameNames("front--left", "---"))
def test_a_pose_reads_back_from_every_format(name, pose, camera, frames):
    file = file_of(pose, camera, frames)
    refused = refusal(lambda: export(file, name, rectified=format_named(name).is_for_rectified))
    if refused:
        assert "which this camera uses" in refused
        return
    written = export(file, name, rectified=format_named(name).is_for_rectified)

    again = read_any(written.data)

    assert again.format == name
    assert export(file, name, rectified=format_named(name).is_for_rectified).data == written.data
    np.testing.assert_allclose(again.camera_from_radar.as_matrix(), pose.as_matrix(), rtol=0, atol=1e-9)
    known = next(known for known in FORMATS if known.name == name)
    if known.comment != "none":
        assert again.frames == (None if known.comment == "numbers" else frames)
        assert check(again, camera=camera).ok
    if again.camera is not None:
        point = np.array([[0.2, -0.1, 3.0]])
        np.testing.assert_allclose(again.camera.project(point), camera.project(point), rtol=0, atol=1e-9)


@given(pose=poses(), direction=st.sampled_from(["roll", "pitch", "yaw"]))
@example(pose=RigidTransform(matrix_from_rpy(np.array([0.3, np.pi / 2, 0.7])), np.zeros(3)), direction="yaw")
@example(pose=RigidTransform(matrix_from_rpy(np.array([0.3, -np.pi / 2 + 1e-7, 0.7])), np.zeros(3)), direction="yaw")
def test_fixed_axis_angles_reproduce_the_rotation_also_at_the_poles(pose, direction):
    rpy = rpy_from_matrix(pose.rotation)

    np.testing.assert_allclose(matrix_from_rpy(rpy), pose.rotation, rtol=0, atol=1e-9)
    from scipy.spatial.transform import Rotation

    np.testing.assert_allclose(Rotation.from_euler("xyz", rpy).as_matrix(), pose.rotation, rtol=0, atol=1e-9)


@given(value=st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_reads_back_bit_for_bit_in_every_reader(value):
    text = number_text(value)

    assert float(text) == value
    assert json.loads(text) == value
    assert yaml_documents(f"x: {text}", source="")[0]["x"] == value
    assert "e" not in text or "." in text


@settings(max_examples=40)
@given(
    clicks=st.lists(
        st.builds(
            ReflectorClick,
            image_time=st.integers(0, 9_223_372_035 * 10**9).map(TimeNs),
            id=st.text(min_size=1, max_size=20),
            u_px=FINITE,
            v_px=FINITE,
            sigma_px=st.none() | st.floats(1e-6, 100),
            excluded=st.booleans(),
        ),
        unique_by=lambda click: click.id,
        max_size=6,
    )
)
def test_clicks_read_back(clicks):
    text = write_clicks(clicks)

    assert read_clicks(text) == tuple(sorted(clicks, key=lambda click: (click.image_time, click.id)))
    assert write_clicks(reversed(clicks)) == text
    text.encode("ascii")


@settings(max_examples=30, deadline=None)
@given(pose=poses(), camera=cameras(), values=st.lists(st.floats(allow_subnormal=False), min_size=9, max_size=9))
def test_whatever_a_calibration_contains_the_file_is_json_and_reads_back_the_same(pose, camera, values):
    a, b, c, d, e, f, g, h, i = values
    finite = [x if abs(x) < 1e9 else 1.0 for x in (a, b, c)]
    pairs = (
        PairResult(
            "p",
            [finite[0], 2.0],
            [finite[1], 1.0] if math.isfinite(b) else [b, 1.0],
            [finite[2], 0, 1],
            True,
            influence=d,
        ),
    )
    metrics = Metrics(a, b, c, n=3, held_out_aed_px=d, acc=None, chi2=e, degrees_of_freedom=2)
    covariance = np.full((6, 6), abs(f))  # a negative variance is refused
    calibration = Calibration(
        pose,
        covariance,
        camera,
        metrics,
        pairs,
        (),
        (),
        CalibrationOptions(),
        covariance_quantile=g,
        iterative_px=h,
        sqpnp_px=i,
    )

    text = calibration_text(calibration)

    json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
    assert write_calibration(read_calibration(text)) == text


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                [
                    "id",
                    "camera",
                    "pairs",
                    "K",
                    "D",
                    "R",
                    "T",
                    "cam0",
                    "intrinsics",
                    "transform",
                    "header",
                    "schema",
                    "x",
                    "yaw",
                ]
            )
            | st.text(max_size=5),
            inner,
            max_size=5,
        )
    ),
    max_leaves=25,
)


@settings(max_examples=80, deadline=None)
@given(
    content=JSON_VALUES, schema=st.sampled_from(["cocalib/pairs-1", "cocalib/clicks-1", "cocalib/calibration-1", None])
)
def test_any_json_is_read_or_refused_in_one_line(content, schema):
    if isinstance(content, dict) and schema:
        content = {**content, "schema": schema}
    text = json.dumps(content)
    for read in (read_pairs, read_clicks, read_calibration, read_camera, read_any):
        refused = refusal(read, text, "file")
        assert not refused or refused.startswith("file: ")
        assert "\n" not in refused


@settings(max_examples=25, deadline=None)
@given(
    value=st.recursive(
        st.none() | st.integers(-(2**53), 2**53) | st.floats() | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    )
)
def test_json_text_is_json_of_the_same_value_with_null_for_what_is_not_finite(value):
    def finite(item):
        if isinstance(item, float) and not math.isfinite(item):
            return None
        if isinstance(item, list):
            return [finite(inner) for inner in item]
        return {key: finite(inner) for key, inner in item.items()} if isinstance(item, dict) else item

    assert json.loads(json_text(value)) == finite(value)
