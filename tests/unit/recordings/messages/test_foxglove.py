"""Foxglove's own messages, in JSON and by their descriptors, as Foxglove's SDK writes them."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove import messages as fox
from mcap.writer import CompressionType, Writer

from calib_core.errors import MessageError, RecordingError
from calib_core.recordings import Recording, RecordingOptions, inspect_recording, open_recording
from calib_core.recordings.containers.sources import Channel
from calib_core.recordings.messages import foxglove
from calib_core.recordings.messages.foxglove import ros_channel, ros_head, ros_message
from calib_core.recordings.verification import verify_recording

COLUMNS = [(name, np.dtype("<f4")) for name in ("x", "y", "z", "doppler_mps", "snr_db")]
KINDS = fox.PackedElementFieldNumericType


def stamp(time: int) -> fox.Timestamp:
    return fox.Timestamp(*divmod(int(time), 10**9))


def cloud(time: int, points: np.ndarray, pose: fox.Pose | None = None, frame: str = "radar") -> fox.PointCloud:
    places = [
        fox.PackedElementField(name=name, offset=4 * i, type=KINDS.Float32) for i, (name, _) in enumerate(COLUMNS)
    ]
    data = np.ascontiguousarray(points, dtype="<f4").tobytes()
    return fox.PointCloud(timestamp=stamp(time), frame_id=frame, pose=pose, point_stride=20, fields=places, data=data)


def as_json(message: Any) -> bytes:
    """Write a message as Foxglove's JSON schemas say, from what the SDK's own protobuf holds."""
    channel = Channel(0, "/t", f"foxglove.{type(message).__name__}", "protobuf", described(type(message)), "")
    values = foxglove._Decoder(foxglove._types(channel.definition)).message(message.encode(), channel.type, 0)

    def plain(value: Any) -> Any:
        if isinstance(value, bytes):
            return base64.b64encode(value).decode()
        if isinstance(value, dict):
            return {key: plain(one) for key, one in value.items()}
        return [plain(one) for one in value] if isinstance(value, list) else value

    return json.dumps(plain(values)).encode()


def described(kind: type) -> str:
    return str(kind.get_schema().data.decode("latin-1"))


def write(path: Path, rows: list[tuple[str, int, Any]], encoding: str) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        channels = {}
        for topic, time, message in rows:
            if topic not in channels:
                schema = type(message).get_schema()
                form, data = ("protobuf", schema.data) if encoding == "protobuf" else ("jsonschema", b"{}")
                number = writer.register_schema(schema.name, form, data)
                channels[topic] = writer.register_channel(topic, encoding, number)
            data = message.encode() if encoding == "protobuf" else as_json(message)
            writer.add_message(channels[topic], time, data, time)
        writer.finish()
    return path


@pytest.fixture(scope="module")
def sample(project_root: Path):
    folder = project_root / "sample_data" / "rooftop"
    with open_recording([folder / "radar.bag", folder / "camera.bag"]) as recording:
        yield recording


def sample_rows(sample: Recording, count: int) -> list[tuple[str, int, Any]]:
    camera, scans = sample.camera(), sample.radar_scans()
    rows: list[tuple[str, int, Any]] = []
    for number in range(min(count, len(scans))):
        scan = scans.scan(number)
        points = np.column_stack([scan.points_radar_m, scan.doppler_mps, scan.snr_db])
        rows.append(("/radar", int(scan.time), cloud(scan.time, points)))
    for number in range(count // 2):
        time = int(sample.image_times[number])
        image = sample.image_bytes(number)
        rows.append(
            (
                "/cam/image",
                time,
                fox.CompressedImage(timestamp=stamp(time), frame_id="cam", data=image.data, format="jpeg"),
            )
        )
        lens = fox.CameraCalibration(
            timestamp=stamp(time), frame_id="cam", width=camera.width_px, height=camera.height_px,
            distortion_model="plumb_bob" if len(camera.distortion) else "", D=camera.distortion.tolist(),
            K=camera.matrix_px.ravel().tolist(), R=np.eye(3).ravel().tolist(), P=np.eye(3, 4).ravel().tolist(),
        )  # fmt: skip
        rows.append(("/cam/calibration", time, lens))
    return sorted(rows, key=lambda row: row[1])


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_the_sample_in_foxgloves_schemas_is_the_sample(sample, tmp_path, encoding):
    path = write(tmp_path / "drive.mcap", sample_rows(sample, 60), encoding)
    with open_recording([path], require=("radar", "image")) as recording:
        scans, truth = recording.radar_scans(), sample.radar_scans()
        assert np.array_equal(scans.times_ns, truth.times_ns[:60])
        assert recording.radar_clock == "header"
        last = int(truth.first_return[60])
        assert scans.points_radar_m == pytest.approx(truth.points_radar_m[:last], abs=1e-5)
        assert scans.doppler_mps == pytest.approx(truth.doppler_mps[:last], abs=1e-5)
        assert np.array_equal(recording.image_times, sample.image_times[:30])
        assert recording.image_bytes(3).data == sample.image_bytes(3).data
        assert recording.camera().matrix_px == pytest.approx(sample.camera().matrix_px)
        assert recording.camera().distortion == pytest.approx(sample.camera().distortion)
        assert (recording.radar_frame, recording.camera_frame) == ("radar", "cam")
        found = verify_recording(recording)
        assert found.sound
        assert {one.topic: one.read for one in found.topics} == {"/radar": 60, "/cam/image": 30, "/cam/calibration": 30}


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_a_raw_image_is_read_and_intrinsics_of_another_frame_are_told(sample, tmp_path, encoding):
    rows = sample_rows(sample, 8)
    pixels = np.arange(600 * 960 * 3, dtype=np.uint32).astype(np.uint8).reshape(600, 960, 3)
    raw = [
        ("/other/image", time, fox.RawImage(
            timestamp=stamp(time), frame_id="other", width=960, height=600, encoding="bgr8", step=2880, data=pixels.tobytes()
        ))
        for topic, time, _ in rows if topic == "/cam/image"
    ]  # fmt: skip
    path = write(tmp_path / "drive.mcap", sorted(rows + raw, key=lambda row: row[1]), encoding)
    with open_recording([path]) as recording:
        assert not [one for one in recording.warnings if one.code == "camera-frame"]
    options = RecordingOptions(image_topic="/other/image", camera_info_topic="/cam/calibration")
    with open_recording([path], options) as recording:
        assert np.array_equal(recording.image(0), pixels)
        (warning,) = [one for one in recording.warnings if one.code == "camera-frame"]
        assert "'cam'" in str(warning)


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_the_pose_of_a_cloud_is_not_applied_and_told(sample, tmp_path, encoding):
    scan = sample.radar_scans().scan(0)
    points = np.column_stack([scan.points_radar_m, scan.doppler_mps, scan.snr_db])
    moved = fox.Pose(
        position=fox.Vector3(x=3.7, y=0, z=0.5), orientation=fox.Quaternion(x=0, y=0, z=0.3826834, w=0.9238795)
    )
    still = fox.Pose(position=fox.Vector3(x=0, y=0, z=0), orientation=fox.Quaternion(x=0, y=0, z=0, w=1))
    for pose, posed in ((moved, True), (still, False)):
        rows = [
            ("/radar", int(scan.time) + 10**8 * i, cloud(int(scan.time) + 10**8 * i, points, pose, "base_link"))
            for i in range(9)
        ]
        with open_recording([write(tmp_path / f"{posed}.mcap", rows, encoding)], require=("radar",)) as recording:
            assert recording.radar_scans().points_radar_m[: len(points)] == pytest.approx(scan.points_radar_m, abs=1e-5)
            codes = {one.code for one in recording.warnings}
            assert ("radar-cloud-posed" in codes, "radar-in-vehicle-frame" in codes) == (posed, not posed)
            assert recording.radar_frame == ("" if posed else "base_link")


def test_video_before_its_first_key_frame_is_refused_and_later_frames_are_read(tmp_path):
    av = pytest.importorskip("av", reason="needs the extra 'video'")
    context: Any = av.CodecContext.create("libx264", "w")
    context.width, context.height, context.pix_fmt, context.gop_size, context.max_b_frames = 128, 64, "yuv420p", 10, 0
    context.options = {"tune": "zerolatency", "preset": "ultrafast", "x264-params": "repeat-headers=1:scenecut=0"}
    packets: list[bytes] = []
    for number in range(30):
        frame = av.VideoFrame.from_ndarray(np.full((64, 128, 3), 8 * number, dtype=np.uint8), format="bgr24")
        frame.pts = number
        packets += [bytes(packet) for packet in context.encode(frame)]
    packets += [bytes(packet) for packet in context.encode(None)]
    times = [10**18 + 10**8 * number for number in range(27)]
    rows = [
        ("/cam/video", time, fox.CompressedVideo(timestamp=stamp(time), frame_id="cam", data=data, format="h264"))
        for time, data in zip(times, packets[3:], strict=True)
    ]
    for encoding in ("protobuf", "json"):
        with open_recording([write(tmp_path / f"{encoding}.mcap", rows, encoding)], require=("image",)) as recording:
            assert recording.image(recording.image_times.tolist().index(times[9])).mean() == pytest.approx(
                8 * 12, abs=4
            )
        path = write(tmp_path / f"cut-{encoding}.mcap", rows[:6], encoding)
        with pytest.raises((MessageError, RecordingError)), open_recording([path], require=("image",)) as recording:
            recording.image(0)


def test_flatbuffers_and_unknown_schemas_are_refused_with_what_to_do():
    with pytest.raises(MessageError, match="flatc"):
        ros_channel(Channel(0, "/radar", "foxglove.PointCloud", "flatbuffer", "", ""))
    unknown = Channel(0, "/log", "foxglove.Log", "protobuf", "", "")
    assert ros_channel(unknown) is unknown
    assert ros_message(unknown, b"as it is") == b"as it is"


def varint(value: int) -> bytes:
    return bytes([value & 0x7F | 0x80]) + varint(value >> 7) if value > 0x7F else bytes([value])


def piece(number: int, data: bytes) -> bytes:
    return varint(number << 3 | 2) + varint(len(data)) + data


def descriptor(*fields: tuple[str, int, int, str]) -> str:
    """Describe foxglove.PointCloud with these fields: name, number, type, name of the type."""
    entries = b"".join(
        piece(
            2,
            piece(1, name.encode())
            + b"\x18"
            + varint(number)
            + b"\x28"
            + varint(kind)
            + (piece(6, of.encode()) if of else b""),
        )
        for name, number, kind, of in fields
    )
    return piece(1, piece(2, b"foxglove") + piece(4, piece(1, b"PointCloud") + entries)).decode("latin-1")


def nested(depth: int) -> bytes:
    data = b""
    for _ in range(depth):
        data = piece(3, data)
    return data


POSED = ("pose", 3, 11, ".foxglove.PointCloud")
BOMBS: dict[str, tuple[str, str, bytes]] = {
    "a message within itself": ("protobuf", descriptor(POSED), nested(5000)),
    "JSON within JSON": ("json", "", b'{"pose":' * 100_000),
    "lists within lists": ("json", "", b'{"other":' + b"[" * 200_000),
    "a length beyond the end": ("protobuf", descriptor(("data", 6, 12, "")), b"\x32\xff\xff\xff\xff\x7f"),
    "a number without end": ("protobuf", descriptor(("data", 6, 12, "")), b"\xff" * 40),
    "no descriptor": ("protobuf", "", b"\x0a\x00"),
    "a descriptor that is none": ("protobuf", "\xff" * 50, b"\x0a\x00"),
    "types within types": ("protobuf", piece(1, piece(4, nested(3000))).decode("latin-1"), b"\x0a\x00"),
    "text for a number": ("json", "", b'{"point_stride": "many"}'),
    "a stride of 2^40": ("json", "", b'{"point_stride": 1099511627776}'),
    "another wire type": ("protobuf", descriptor(("point_stride", 4, 7, "")), b"\x20\x05"),
    "text for a message": ("protobuf", descriptor(("pose", 3, 9, "")), piece(3, b"here")),
}


@pytest.mark.parametrize("name", BOMBS)
def test_what_is_no_message_is_refused_in_words(name):
    encoding, definition, payload = BOMBS[name]
    channel = Channel(0, "/radar", "foxglove.PointCloud", encoding, definition, "")
    with pytest.raises(MessageError, match="does not fit its schema"):
        ros_message(channel, payload)
    assert ros_head(channel, payload[:96]) is None


def test_a_stamp_is_read_from_the_first_bytes_or_from_all_of_them():
    message = cloud(1_700_000_000_123_456_789, np.zeros((50, 5)))
    head = struct.pack("<III", 0, 1_700_000_000, 123_456_789)
    known = Channel(0, "/radar", "foxglove.PointCloud", "protobuf", described(fox.PointCloud), "")
    assert ros_head(known, message.encode()[:96]) == ros_message(known, message.encode())[:12] == head
    plain = Channel(0, "/radar", "foxglove.PointCloud", "json", "", "")
    text = as_json(message)
    assert ros_head(plain, text[:96]) == ros_message(plain, text)[:12] == head
    late = json.dumps(dict(reversed(json.loads(text).items()))).encode()
    assert ros_head(plain, late[:96]) is None
    assert ros_message(plain, late)[:12] == head


def test_info_names_the_topics_by_foxgloves_types(sample, tmp_path):
    path = write(tmp_path / "drive.mcap", sample_rows(sample, 6), "protobuf")
    with inspect_recording([path]) as recording:
        assert {topic.name: (topic.type, topic.kind) for topic in recording.topics} == {
            "/radar": ("foxglove.PointCloud", "radar"),
            "/cam/image": ("foxglove.CompressedImage", "image"),
            "/cam/calibration": ("foxglove.CameraCalibration", "camera-info"),
        }
