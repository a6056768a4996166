"""H.264 and H.265 topics: frames that depend on those before them."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import inspect_recording, open_recording
from tests.unit.recordings.conftest import altered

av = pytest.importorskip("av", reason="needs the extra 'video'")

START_NS = 1_700_000_000 * NS_PER_S
FRAMES = 40
KEY_EVERY = 10


def striped(number: int) -> np.ndarray:
    """Write a number into an image: eight stripes, one per bit."""
    bits = [255 if number >> bit & 1 else 0 for bit in range(8)]
    return np.repeat(np.repeat(np.array(bits, dtype=np.uint8), 16)[None, :, None], 64, axis=0).repeat(3, axis=2)


def number_in(image: np.ndarray) -> int:
    bits = image.mean(axis=(0, 2)).reshape(8, 16).mean(axis=1) > 127
    return int(sum(1 << bit for bit in range(8) if bits[bit]))


@pytest.fixture(scope="module", params=["h264", "hevc"])
def coded(request: pytest.FixtureRequest) -> tuple[str, list[bytes]]:
    """Return the codec and one encoded frame per image, as an encoder on a robot sends them."""
    codec = str(request.param)
    context: Any = av.CodecContext.create({"h264": "libx264", "hevc": "libx265"}[codec], "w")
    context.width, context.height, context.pix_fmt, context.time_base = 128, 64, "yuv420p", Fraction(1, 10)
    context.gop_size, context.max_b_frames = KEY_EVERY, 0
    context.options = {
        "tune": "zerolatency",
        "preset": "ultrafast",
        "x265-params": "log-level=none:repeat-headers=1:bframes=0",
    }
    if codec == "h264":
        context.options = {"tune": "zerolatency", "preset": "ultrafast", "x264-params": "repeat-headers=1:scenecut=0"}
    packets = []
    for number in range(FRAMES):
        frame = av.VideoFrame.from_ndarray(striped(number), format="bgr24")
        frame.pts = number
        packets += [bytes(packet) for packet in context.encode(frame)]
    packets += [bytes(packet) for packet in context.encode(None)]
    assert len(packets) == FRAMES
    return codec, packets


def foxglove(ros: Any, codec: str, stamp_ns: int, data: bytes) -> Any:
    kind = "foxglove_msgs/msg/CompressedVideo"
    if kind not in ros.store.types:
        ros.define(kind, "builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n")
    said = {"h264": "h264", "hevc": "h265"}[codec]
    stamp = ros.header(stamp_ns).stamp
    return ros.new(kind, timestamp=stamp, frame_id="cam", data=np.frombuffer(data, dtype=np.uint8), format=said)


def ffmpeg(ros: Any, codec: str, stamp_ns: int, data: bytes) -> Any:
    kind = "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
    if kind not in ros.store.types:
        text = "Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\nuint8 flags\nbool is_bigendian\n"
        ros.define(kind, text + "uint8[] data\n")
    said = {"h264": "libx264", "hevc": "hevc_nvenc"}[codec]
    return ros.new(
        kind, header=ros.header(stamp_ns, "cam"), width=128, height=64, encoding=said, pts=0, flags=0, is_bigendian=False,
        data=np.frombuffer(data, dtype=np.uint8),
    )  # fmt: skip


def image(ros: Any, codec: str, stamp_ns: int, data: bytes) -> Any:
    return ros.compressed(stamp_ns, data, codec, "cam")


Build = Callable[[Any, str, int, bytes], Any]


def recorded(write: Any, ros: Any, build: Build, codec: str, packets: list[bytes]) -> Any:
    rows = [
        ("/camera/video", START_NS + i * 10**8, build(ros, codec, START_NS + i * 10**8, data))
        for i, data in enumerate(packets)
    ]
    return write(ros, rows)


@pytest.mark.parametrize("build", [foxglove, ffmpeg, image])
def test_every_frame_of_a_video_topic_is_decoded_correctly_in_any_order(build, coded, ros2, write):
    with open_recording(recorded(write, ros2, build, *coded), require=("image",)) as recording:
        assert recording.camera_frame == "cam"
        np.testing.assert_array_equal(recording.image_times, START_NS + 10**8 * np.arange(FRAMES))
        for index in (0, 1, 2, 35, 7, 6, 39, 20, 10, 9, 30, 38):
            assert number_in(recording.image(index)) == index
        frame = recording.image_bytes(13)
        assert (frame.format, frame.width_px, frame.height_px) == ("jpeg", 128, 64)
        assert recording.warnings == ()


def test_frames_before_the_first_key_frame_are_skipped_with_a_warning(coded, ros2, write):
    codec, packets = coded
    with open_recording(recorded(write, ros2, foxglove, codec, packets[3:]), require=("image",)) as recording:
        (warning,) = recording.warnings
        assert warning.code == "video-before-key"
        assert "7 frames of /camera/video" in warning.facts["message"]
        assert len(recording.image_times) == FRAMES - KEY_EVERY
        assert number_in(recording.image(0)) == KEY_EVERY


def test_a_damaged_frame_does_not_affect_the_next_key_frame(coded, ros2, write):
    codec, packets = coded
    packets = [*packets[:5], b"", *packets[6:]]
    with open_recording(recorded(write, ros2, foxglove, codec, packets), require=("image",)) as recording:
        with pytest.raises(MessageError, match="topic /camera/video: frame 5 of the video"):
            recording.image(5)
        with pytest.raises(MessageError, match="frame 5 of the video is empty"):
            recording.image(7)
        assert number_in(recording.image(12)) == 12
        assert number_in(recording.image(3)) == 3


def test_video_without_start_codes_is_explained(ros2, write):
    path = recorded(write, ros2, foxglove, "h264", [bytes([0, 0, 0, 9]) + bytes(9)])
    with pytest.raises(RecordingError, match=r"are declared as h264 but have no start codes \(Annex B\)"):
        open_recording(path, require=("image",))


def test_without_the_extra_the_recording_says_what_to_install(coded, ros2, write, monkeypatch):
    monkeypatch.setattr("calib_core.recordings.camera.video_packets.find_spec", lambda name: None)
    path = recorded(write, ros2, foxglove, *coded)
    with pytest.raises(
        RecordingError, match=r"video, which needs PyAV; install it with: pip install 'cocalib\[video\]'"
    ):
        open_recording(path, require=("image",))
    with inspect_recording(path) as recording:
        assert "needs PyAV" in str(recording.topics[0].problem)


def test_a_jpeg_that_says_h264_is_a_jpeg(ros2, write, jpeg):
    path = recorded(write, ros2, image, "h264", [jpeg, jpeg])
    with open_recording(path, require=("image",)) as recording:
        assert recording.image_bytes(1).data == jpeg


@pytest.mark.parametrize("make", [foxglove, ffmpeg])
def test_video_is_read_from_bags_without_definitions(coded, ros2, write, make):
    codec, packets = coded
    rows = [
        ("/video", START_NS + i * NS_PER_S // 10, make(ros2, codec, START_NS + i * NS_PER_S // 10, data))
        for i, data in enumerate(packets[:12])
    ]
    path = altered(write(ros2, rows, "db3"), "DROP TABLE message_definitions")
    with open_recording(path, require=("image",)) as recording:
        assert [number_in(recording.image(i)) for i in range(12)] == list(range(12))
