"""Messages that no registry knows are read by what they say about themselves: right, or with a stated assumption."""

import contextlib
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calib_core.errors import MessageError, OptionError, RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings import RecordingOptions, describe, inspect_recording, open_recording
from calib_core.recordings.messages.definitions import parse_definition
from calib_core.recordings.plain_files.source import header_bytes
from calib_core.recordings.radar.layouts import recognise
from tests.unit.recordings.radar.test_registry import damaged
from tests.unit.recordings.radar.vendor_layouts import LAYOUTS, POLAR, RETURNS, SCANS, START_NS, Truth, fields, listed


def truths(scans: int = SCANS) -> list[Truth]:
    return [Truth.of(scan) for scan in range(scans)]


def joined(name: str) -> np.ndarray:
    return np.concatenate([getattr(truth, name) for truth in truths()])


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_vendors_layout_is_read_right_and_what_it_does_not_state_is_assumed(name):
    layout = LAYOUTS[name]
    with layout.recording() as recording:
        scans = recording.radar_scans()
        assumed = [one.key for one in recording.assumptions]
        text = describe(recording)
    assert sorted(assumed) == sorted(layout.assumed)
    np.testing.assert_array_equal(np.diff(scans.first_return), [RETURNS] * SCANS)
    points = np.concatenate([layout.positions(truth) for truth in truths()])
    np.testing.assert_allclose(scans.points_radar_m, points, atol=layout.tolerance_m)
    if layout.speed:
        np.testing.assert_allclose(scans.doppler_mps, joined("doppler"), atol=0.01)
    rounded = "int8" in layout.definition
    np.testing.assert_allclose(scans.snr_db, joined("amplitude"), atol=0.51 if rounded else 1e-4)
    for note in layout.notes:
        assert note in text
    for one in recording.assumptions:
        assert one.topic == "/radar"
        assert one.text in " ".join(text.split())


@pytest.mark.parametrize("name", [name for name, layout in LAYOUTS.items() if layout.assumed])
def test_confirmed_assumptions_are_no_longer_open_and_give_no_warning(name):
    with LAYOUTS[name].recording(confirm_assumptions=True) as recording:
        assert recording.assumptions == ()
        assert [one.confirmed for one in recording.stated_assumptions] == [True] * len(LAYOUTS[name].assumed)
        assert "assumed" not in [warning.code for warning in recording.warnings]


@pytest.mark.slow
@pytest.mark.parametrize("name", LAYOUTS)
def test_damaged_messages_of_vendors_give_values_or_one_clear_error(name):
    layout = LAYOUTS[name]
    definition = parse_definition(layout.kind, layout.definition, "ros1")
    payloads = [header_bytes(TimeNs(START_NS), "radar") + layout.body(Truth.of(scan)) for scan in range(3)]
    reader = recognise(definition, payloads[0], lambda count: payloads)
    assert reader is not None
    rng = random.Random(name)
    for _ in range(40):
        worse = damaged(payloads[0], rng)
        with contextlib.suppress(MessageError):
            recognise(definition, worse, lambda count, worse=worse: [worse, *payloads])
        with contextlib.suppress(MessageError):
            reader.returns(worse)


def test_a_second_azimuth_is_named_and_not_read():
    with listed(POLAR + "\nfloat32 azimuth_2 = half # rad").recording(scans=2) as recording:
        (other,) = [one.column for one in recording.radar_columns if one.quantity == "other azimuth"]
        points = recording.radar_scans().points_radar_m
    assert other == "azimuth_2"
    np.testing.assert_allclose(points, np.concatenate([truth.points for truth in truths(2)]), atol=1e-3)


PREFIXES = ["", "f_", "m_", "s_", "det_", "target_", "f", "radar_", "obj_", "fl"]


@settings(max_examples=25, deadline=None)
@given(st.sampled_from(PREFIXES), st.permutations(range(7)), st.booleans())
def test_prefixes_and_the_order_of_fields_do_not_change_what_is_read(prefix, order, capital):
    rows = fields(POLAR + "\nuint16 id = id\nfloat32 range_std = half")
    lines = []
    for place in order:
        kind, name, comment, quantity = rows[place]
        name = prefix + (name.title() if capital or prefix in ("f", "fl") else name)
        lines.append(f"{kind} {name} = {quantity}" + (f" # {comment}" if comment else ""))
    with listed("\n".join(lines)).recording(scans=3) as recording:
        scans = recording.radar_scans()
        assert recording.assumptions == ()
    expected = truths(3)
    np.testing.assert_allclose(scans.points_radar_m, np.concatenate([one.points for one in expected]), atol=1e-3)
    np.testing.assert_allclose(scans.doppler_mps, np.concatenate([one.doppler for one in expected]), atol=1e-3)
    np.testing.assert_allclose(scans.snr_db, np.concatenate([one.amplitude for one in expected]), atol=1e-3)


# What the user states with --map and --radar-axes replaces what was recognised in messages.


NAMES = ("alpha1", "alpha2", "posX", "posY", "q", "theta", "dist", "vel")


def write_list(ros: Any, write: Callable[..., Any], rows: np.ndarray, *, scans: int = 4) -> Any:
    kind = ros.define("vendor_msgs/msg/Det", "".join(f"float32 {name}\n" for name in NAMES))
    ros.define("vendor_msgs/msg/Body", "uint8 version\nvendor_msgs/Det[] dets\n")
    outer = ros.define("vendor_msgs/msg/Scan", "Header header\nvendor_msgs/Body body\n")
    elements = [ros.new(kind, **dict(zip(NAMES, row, strict=True))) for row in rows.tolist()]
    messages = []
    for i in range(scans):
        body = ros.new("vendor_msgs/msg/Body", version=1, dets=elements)
        at = START_NS + i * 10**8
        messages.append(("/radar", at, ros.new(outer, header=ros.header(at), body=body)))
    return write(ros, messages)


@pytest.fixture
def rows() -> np.ndarray:
    rng = np.random.default_rng(4)
    table = rng.uniform(1, 9, (12, len(NAMES))).astype(np.float32).astype(np.float64)
    table[:, NAMES.index("theta")] /= 10
    return table


def column(rows: np.ndarray, name: str) -> np.ndarray:
    return rows[:, NAMES.index(name)]


def opened(path: Any, *maps: str, **options: Any) -> Any:
    return open_recording(path, RecordingOptions(map=maps, **options), require=("radar",))


def test_columns_units_and_signs_that_the_user_maps_are_used_and_leave_nothing_assumed(ros, write, rows):
    path = write_list(ros, write, rows)
    maps = ("x=alpha1:cm", "y=-alpha2:m", "z=q:mm", "doppler=vel:kmh", "amplitude=dist:db")
    with opened(path, *maps) as recording:
        scan = recording.radar_scans().scan(0)
        assert recording.assumptions == ()
        assert recording.column_map == maps
        assert "--map y=-alpha2:m" in describe(recording)
    expected = np.stack([column(rows, "alpha1") / 100, -column(rows, "alpha2"), column(rows, "q") / 1000], axis=1)
    np.testing.assert_allclose(scan.points_radar_m, expected, rtol=1e-6)
    np.testing.assert_allclose(scan.doppler_mps, column(rows, "vel") / 3.6, rtol=1e-6)
    np.testing.assert_allclose(scan.snr_db, column(rows, "dist"), rtol=1e-6)


def test_columns_may_be_named_from_the_message_on(ros, write, rows):
    with opened(write_list(ros, write, rows), "x=body.dets.posX:m", "y=body.dets.posY:m") as recording:
        found = recording.radar_scans().scan(0).points_radar_m
    np.testing.assert_allclose(found[:, 1], column(rows, "posY"), rtol=1e-6)


def test_a_polar_position_can_be_mapped_with_the_angle_counted_to_the_right(ros, write, rows):
    path = write_list(ros, write, rows)
    with opened(path, "range=dist:m", "azimuth=-theta:deg", "doppler=vel:mps") as recording:
        found = recording.radar_scans().scan(0).points_radar_m
        assert recording.assumptions == ()
    angle = np.radians(-column(rows, "theta"))
    expected = column(rows, "dist")[:, None] * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_a_map_combines_with_the_axes(ros, write, rows):
    with opened(write_list(ros, write, rows), "x=posX:m", "y=posY:m", radar_axes="right,forward,up") as recording:
        found = recording.radar_scans().scan(0).points_radar_m
        assert [one.key for one in recording.assumptions] == ["speed-unit"]
    np.testing.assert_allclose(found[:, 0], column(rows, "posY"), rtol=1e-6)
    np.testing.assert_allclose(found[:, 1], -column(rows, "posX"), rtol=1e-6)


def test_a_map_without_a_unit_leaves_the_unit_assumed(ros, write, rows):
    with opened(write_list(ros, write, rows), "x=alpha1", "y=alpha2", "doppler=vel:mps") as recording:
        (one,) = recording.assumptions
    assert (one.key, one.confirm) == ("length-unit", "--map x=alpha1:m --map y=alpha2:m")


def test_a_column_that_does_not_exist_is_refused_with_the_nearest_names(ros1, write, rows):
    path = write_list(ros1, write, rows)
    with pytest.raises(RecordingError, match=r"--map x=pos_X:m: the messages have no column 'pos_X'") as caught:
        opened(path, "x=pos_X:m", "y=posY:m")
    assert "nearest are body.dets.posX, body.dets.posY" in str(caught.value)
    with inspect_recording(path, RecordingOptions(map=("x=pos_X:m",))) as recording:
        assert "no column 'pos_X'" in str(recording.topics[0].problem)


def test_half_a_position_is_refused(ros1, write, rows):
    path = write_list(ros1, write, rows)
    with pytest.raises(OptionError, match="azimuth is not known"):
        opened(path, "range=dist:m")
    with pytest.raises(OptionError, match="choose the clock with --clock"):
        opened(path, "time=q:ns")


def test_the_unit_that_was_recognised_stays_when_only_the_sign_is_mapped(ros1, write, cloud_points):
    points = np.zeros(24, dtype=[(name, "<f4") for name in ("Rng", "Azi_deg", "vRad")])
    points["Rng"], points["Azi_deg"] = np.linspace(5, 60, 24), np.linspace(-50, 50, 24)
    rows = [("/radar", START_NS + i * 10**8, ros1.cloud(START_NS + i * 10**8, points)) for i in range(3)]
    with opened(write(ros1, rows), "azimuth=-Azi_deg") as recording:
        found = recording.radar_scans().scan(0).points_radar_m
        assert recording.assumptions == ()
    np.testing.assert_allclose(np.degrees(np.arctan2(found[:, 1], found[:, 0])), -points["Azi_deg"], atol=1e-4)


def test_a_list_of_structs_that_is_not_recognised_is_mentioned_with_its_fields(ros, write):
    kind = ros.define("vendor_msgs/msg/Blob", "float32 a1\nfloat32 a2\nfloat32 a3\n")
    outer = ros.define("vendor_msgs/msg/Blobs", "Header header\nvendor_msgs/Blob[] blobs\n")
    message = ros.new(outer, header=ros.header(START_NS), blobs=[ros.new(kind, a1=1.0, a2=2.0, a3=3.0)])
    with inspect_recording(write(ros, [("/front/points", START_NS, message)])) as recording:
        (topic,) = recording.topics
        assert topic.problem in describe(recording)
    assert "fields a1, a2, a3" in str(topic.problem)
    assert "--map x=FIELD:m" in str(topic.problem)


def test_a_list_of_structs_that_are_little_more_than_bytes_is_raw_whatever_its_name(ros, write):
    kind = ros.define("vendor_msgs/msg/Chunk", "uint64 stamp\nuint8[] payload\n")
    outer = ros.define("vendor_msgs/msg/Frame", "Header header\nvendor_msgs/Chunk[] chunks\n")
    chunk = ros.new(kind, stamp=3, payload=np.arange(40, dtype=np.uint8))
    message = ros.new(outer, header=ros.header(START_NS), chunks=[chunk])
    with inspect_recording(write(ros, [("/front/raw", START_NS, message)])) as recording:
        assert "raw sensor packets" in str(recording.topics[0].problem)


def test_a_message_without_a_stamp_at_its_start_is_read_by_its_receive_times(ros, write):
    kind = ros.define("vendor_msgs/msg/Ret", "float32 range_m\nfloat32 azimuth_rad\nfloat32 doppler_mps\n")
    outer = ros.define("vendor_msgs/msg/Cycle", "uint32 cycle\nvendor_msgs/Ret[] rets\n")
    rets = [ros.new(kind, range_m=5.0 + k, azimuth_rad=0.02 * k, doppler_mps=0.0) for k in range(30)]
    rows = [("/radar", START_NS + i * 10**8, ros.new(outer, cycle=i, rets=rets)) for i in range(3)]
    with opened(write(ros, rows)) as recording:
        assert recording.radar_clock == "receive"
        assert recording.radar_times.tolist() == [START_NS + i * 10**8 for i in range(3)]
        found = recording.radar_scans().scan(0).points_radar_m
    np.testing.assert_allclose(np.hypot(found[:, 0], found[:, 1]), 5.0 + np.arange(30), rtol=1e-6)
