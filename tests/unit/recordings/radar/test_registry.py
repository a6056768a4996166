"""Every layout of the registry, read from bytes built from its real definition; contradictions; axes given by the user."""

import contextlib
import random
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.errors import MessageError, OptionError, RecordingError
from calib_core.recordings import RecordingOptions, describe, open_recording
from calib_core.recordings.containers.opening import open_sources
from calib_core.recordings.radar.column_plan import parse_radar_axes
from calib_core.recordings.radar.layouts import recognise
from calib_core.recordings.radar.registry import DECODERS
from calib_core.recordings.topics import join_topics
from tests.unit.recordings.conftest import altered
from tests.unit.recordings.radar.radar_samples import CLOUDS, OTHERS, START_NS, sample

NAMES = [decoder.name for decoder in DECODERS]


def opened(write: Callable[..., Any], ros: Any, messages: list[Any], **options: Any) -> Any:
    rows = [("/radar", START_NS + 10**6 * i, message) for i, message in enumerate(messages)]
    return open_recording(write(ros, rows), RecordingOptions(**options), require=("radar",))


def test_every_layout_of_the_registry_has_a_sample():
    assert sorted(NAMES) == sorted([*CLOUDS, *OTHERS])


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_layout_is_recognised_and_read(name, ros, write):
    expected = sample(ros, name)
    with opened(write, ros, expected.messages) as recording:
        scans = recording.radar_scans()
        (topic,) = recording.topics
        codes = [warning.code for warning in recording.warnings]
    assert topic.layout.startswith(f"{name}: ") or f": {name}: " in topic.layout
    assert len(scans) == 1
    np.testing.assert_allclose(scans.points_radar_m, expected.points, rtol=1e-6, atol=1e-6)
    nothing = np.full(len(expected.points), np.nan)
    for found, wanted in ((scans.doppler_mps, expected.doppler), (scans.snr_db, expected.amplitude)):
        np.testing.assert_allclose(found, nothing if wanted is None else wanted, rtol=1e-6)
    sigma = np.full((len(expected.points), 3), np.nan) if expected.sigma is None else expected.sigma
    np.testing.assert_allclose(scans.sigma_polar, sigma, rtol=1e-6)
    assert sorted(codes) == sorted(expected.warnings)


def damaged(payload: bytes, rng: random.Random) -> bytes:
    """Overwrite, remove or truncate a few bytes, including counts of billions."""
    raw = bytearray(payload)
    for _ in range(rng.choice([1, 1, 2, 4])):
        place = rng.randrange(max(1, len(raw)))
        kind = rng.random()
        if kind < 0.7:
            raw[place : place + 4] = rng.choice(
                [b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\0", rng.randbytes(4)]
            )
        elif kind < 0.9:
            del raw[place : place + rng.randrange(1, 9)]
        else:
            del raw[place:]
    return bytes(raw)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_damaged_messages_of_any_layout_give_values_or_one_clear_error(name, ros, write):
    path = write(ros, [("/radar", START_NS, sample(ros, name).messages[0])])
    (source,) = open_sources([path])
    (topic,), _ = join_topics([source])
    definition, payload = topic.definition(), topic.payload(0)
    source.close()
    layout = recognise(definition, payload)
    rng = random.Random(name)
    for _ in range(60):
        worse = damaged(payload, rng)
        with contextlib.suppress(MessageError):
            recognise(definition, worse)
        with contextlib.suppress(MessageError):
            layout.returns(worse)


@pytest.mark.parametrize(
    "name", ["Oculii cloud", "ARS548 detections, 18 fields", "radar_msgs scan", "radar_msgs tracks"]
)
def test_types_that_ros_defines_are_read_from_bags_without_definitions(name, ros2, write):
    expected = sample(ros2, name)
    path = write(ros2, [("/radar", START_NS, message) for message in expected.messages], "db3")
    with open_recording(altered(path, "DROP TABLE message_definitions"), require=("radar",)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, expected.points, rtol=1e-6, atol=1e-6)


def test_files_of_a_package_beside_a_database_define_its_messages(ros2, write):
    ros2.define("our_msgs/msg/Target", "float32 range\nfloat32 azimuth\nfloat32 doppler_velocity\n")
    ros2.define(
        "our_msgs/msg/Targets", "std_msgs/Header header\nour_msgs/Target[] targets\ngeometry_msgs/Point mount\n"
    )
    target = ros2.new("our_msgs/msg/Target", range=5.0, azimuth=0.1, doppler_velocity=0.0)
    mount = ros2.new("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
    message = ros2.new("our_msgs/msg/Targets", header=ros2.header(START_NS), targets=[target] * 3, mount=mount)
    path = altered(write(ros2, [("/radar", START_NS, message)], "db3"), "DROP TABLE message_definitions")
    with pytest.raises(RecordingError, match=r"put its package's files as our_msgs/msg/Targets\.msg"):
        open_recording(path, RecordingOptions(radar_topic="/radar"), require=("radar",))
    folder = path.parent / "our_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Target.msg").write_text("float32 range  # [m]\nfloat32 azimuth  # deg\nfloat32 doppler_velocity\n")
    (folder / "Targets.msg").write_text("std_msgs/Header header\nTarget[] targets\ngeometry_msgs/Point mount\n")
    with open_recording(path, require=("radar",)) as recording:
        angle = np.radians(0.1)
        expected = [5 * np.cos(angle), 5 * np.sin(angle), 0.0]
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, [expected] * 3, rtol=1e-6)


# -- contradictions
def changed(
    ros: Any, cloud_points: Callable[..., np.ndarray], **columns: Callable[[np.ndarray], np.ndarray]
) -> list[Any]:
    """Return clouds with further columns computed from x, y, z."""
    points = cloud_points(12)
    xyz = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
    wide = np.zeros(12, dtype=[*points.dtype.descr, *((name, "<f4") for name in columns)])
    for name in points.dtype.names or ():
        wide[name] = points[name]
    for name, make in columns.items():
        wide[name] = make(xyz)
    return [ros.cloud(START_NS + i * 10**8, wide) for i in range(3)]


def length(xyz: np.ndarray) -> np.ndarray:
    return np.linalg.norm(xyz, axis=1)


def azimuth(xyz: np.ndarray) -> np.ndarray:
    return np.arctan2(xyz[:, 1], xyz[:, 0])


@pytest.mark.parametrize(
    ("columns", "code"),
    [
        ({"range": length, "azimuth": azimuth}, None),
        ({"range": lambda p: 0 * length(p), "azimuth": lambda p: 0 * azimuth(p)}, None),
        ({"azimuth": lambda p: np.degrees(azimuth(p))}, None),
        ({"range": lambda p: 2 * length(p)}, "radar-range-contradicts"),
        ({"azimuth": lambda p: -azimuth(p)}, "radar-azimuth-mirrored"),
        ({"azimuth": lambda p: -np.degrees(azimuth(p))}, "radar-azimuth-mirrored"),
        ({"azimuth": lambda p: 0.4 + 0.3 * length(p)}, "radar-azimuth-contradicts"),
    ],
)
def test_columns_that_contradict_the_positions_give_a_warning(columns, code, ros1, write, cloud_points):
    with opened(write, ros1, changed(ros1, cloud_points, **columns)) as recording:
        assert [warning.code for warning in recording.warnings] == ([code] if code else [])


def polar_cloud(ros: Any, azimuths: np.ndarray) -> Any:
    points = np.zeros(len(azimuths), dtype=[(name, "<f4") for name in ("range", "azimuth", "elevation", "doppler")])
    points["range"], points["azimuth"] = 5.0 + np.arange(len(azimuths)), azimuths
    points["elevation"] = azimuths / 8
    return ros.cloud(START_NS, points)


def test_angles_in_degrees_are_recognised_by_their_values_and_only_their_sign_is_assumed(ros1, write):
    angles = np.linspace(-60.0, 60.0, 24)
    message = polar_cloud(ros1, angles)
    with opened(write, ros1, [message]) as recording:
        assert [one.key for one in recording.assumptions] == ["azimuth-sign"]
        points = recording.radar_scans().points_radar_m
    np.testing.assert_allclose(np.degrees(np.arctan2(points[:, 1], points[:, 0])), angles, atol=1e-4)
    write_again = lambda *a, **k: write(*a, name="again", **k)  # noqa: E731
    with opened(write_again, ros1, [message], radar_axes="forward,right,up") as recording:
        assert recording.warnings == ()
        points = recording.radar_scans().points_radar_m
    np.testing.assert_allclose(np.degrees(np.arctan2(points[:, 1], points[:, 0])), -angles, atol=1e-4)


def test_angles_that_the_user_states_in_the_wrong_unit_give_a_warning(ros1, write):
    message = polar_cloud(ros1, np.linspace(-60.0, 60.0, 24))
    with opened(write, ros1, [message], radar_axes="forward,left,up,radians") as recording:
        (warning,) = recording.warnings
    assert warning.code == "radar-angle-unit"
    assert "angles up to 60.0" in warning.facts["message"]
    assert "--radar-axes degrees" in warning.facts["hint"]


def test_radians_read_as_degrees_give_a_warning(ros2, write):
    kind = ros2.define(
        "ainstein_radar_msgs/msg/RadarTarget",
        "uint16 target_id\nfloat64 snr\nfloat64 range\nfloat64 speed\nfloat64 azimuth\nfloat64 elevation\n",
    )
    array = ros2.define(
        "ainstein_radar_msgs/msg/RadarTargetArray", "Header header\nainstein_radar_msgs/RadarTarget[] targets\n"
    )
    targets = [
        ros2.new(kind, target_id=i, snr=1.0, range=5.0 + i, speed=0.0, azimuth=0.1 * i - 1, elevation=0.01 * i)
        for i in range(20)
    ]
    message = ros2.new(array, header=ros2.header(START_NS), targets=targets)
    with opened(write, ros2, [message]) as recording:
        (warning,) = recording.warnings
    assert warning.code == "radar-angle-unit"
    assert "small for degrees" in warning.facts["message"]


# -- axes given by the user
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("forward,left,up", [[1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        ("right, forward, up", [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
        ("RIGHT DOWN FORWARD", [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]),
        ("backward,left,down,radians", [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]),
        ("degrees", np.eye(3)),
    ],
)
def test_the_axes_option_becomes_a_signed_permutation(words, expected):
    axes = parse_radar_axes(words)
    np.testing.assert_array_equal(axes.matrix, expected)
    assert axes.degrees == {"radians": False, "degrees": True}.get(words.rpartition(",")[2])


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("forward,north,up", "'north' is unknown; use forward, backward"),
        ("forward,left", "give the directions of the message's x, y and z"),
        ("forward,left,up,degrees,radians", "at most one unit"),
        ("", "give the directions of the message's x, y and z"),
        ("forward,backward,up", "two of the directions lie on the same axis"),
    ],
)
def test_invalid_axes_are_refused_with_a_clear_error(words, complaint):
    with pytest.raises(OptionError, match="--radar-axes") as caught:
        parse_radar_axes(words)
    assert complaint in str(caught.value)


def test_axes_given_by_the_user_apply_to_positions_and_are_shown(ros, write, cloud_points):
    points = cloud_points(5)
    messages = [ros.cloud(START_NS + i * 10**8, points[: 5 - i]) for i in range(2)]
    with opened(write, ros, messages, radar_axes="right,forward,up") as recording:
        found = recording.radar_scans().points_radar_m[:5]
        assert "as given: x right," in describe(recording)
        assert recording.radar_axes == "right,forward,up"
    np.testing.assert_array_equal(found, np.stack([points["y"], -points["x"], points["z"]], axis=1))


def test_a_mirrored_radar_is_corrected_and_its_assumption_gives_no_warning(ros, write):
    expected = sample(ros, "UniBw detections")
    with opened(write, ros, expected.messages, radar_axes="forward,right,up,radians") as recording:
        found = recording.radar_scans()
        assert recording.warnings == ()
    np.testing.assert_allclose(found.points_radar_m, expected.points * [1, -1, 1], rtol=1e-6)


def test_the_noise_of_a_track_is_rotated_with_its_axes(ros1, write):
    expected = sample(ros1, "radar_msgs tracks")
    with opened(write, ros1, expected.messages, radar_axes="forward,right,up") as recording:
        sigma = recording.radar_scans().sigma_polar
    np.testing.assert_allclose(sigma, expected.sigma, rtol=1e-6)
    write_again = lambda *a, **k: write(*a, name="again", **k)  # noqa: E731
    with opened(write_again, ros1, expected.messages, radar_axes="forward,up,left") as recording:
        turned = recording.radar_scans().sigma_polar
    np.testing.assert_allclose(
        turned[0], expected.sigma[0][[0, 2, 1]], rtol=1e-6
    )  # straight ahead, azimuth and elevation swap


def test_an_invalid_option_is_refused_before_anything_is_read(ros1, write, plain, jpeg):
    with pytest.raises(OptionError, match="'sideways' is unknown"):
        open_recording(write(ros1, plain(ros1, jpeg)), RecordingOptions(radar_axes="sideways"))


def test_the_page_of_radar_formats_has_the_tables_of_the_registry():
    docs = Path(__file__).parents[4] / "docs"
    page = (docs / "radar-formats.md").read_text(encoding="utf-8")
    made = runpy.run_path(str(docs / "make_radar_formats.py"))["with_tables"](page)
    assert page == made, "run: python docs/make_radar_formats.py"
    assert all(f"| {name} |" in page for name in NAMES)


def test_layouts_are_told_apart_and_use_only_fields_that_they_ask_for():
    assert len(set(NAMES)) == len(NAMES)
    kinds = [(decoder.kind, frozenset(map(str.lower, decoder.fields))) for decoder in DECODERS]
    assert len(set(kinds)) == len(kinds)
    for decoder in DECODERS:
        used = (*decoder.polar, *decoder.needed, decoder.doppler, decoder.amplitude_field, decoder.covariance)
        assert {name.lower() for name in used if name} <= {name.lower() for name in decoder.fields}, decoder.name
