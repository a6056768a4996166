"""Writing the camera as a video: the same JPEG, at the recorded times."""

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import SkippedFrames, open_recording, video_writing, write_video

START_NS = 1_700_000_000 * NS_PER_S


def packets(path):
    av = pytest.importorskip("av", reason="the extra 'video' is not installed")
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        return [(p.pts * stream.time_base, bytes(p)) for p in container.demux(stream) if p.pts is not None]


def camera_rows(ros, images, gaps_ms=()):
    at, rows = START_NS, []
    for number, image in enumerate(images):
        at += 33_333_333 + (gaps_ms[number] * 1_000_000 if number < len(gaps_ms) else 0)
        form = "png" if image.startswith(b"\x89PNG") else "jpeg"
        rows.append(("/camera/image/compressed", at, ros.compressed(at, image, form)))
    return rows


@pytest.mark.parametrize(("suffix", "exact_s"), [("mp4", 1e-6), ("mov", 1e-6), ("mkv", 1e-3)])
def test_every_frame_is_in_the_video_as_recorded_at_its_recorded_time(ros, write, jpeg, tmp_path, suffix, exact_s):
    pytest.importorskip("av")
    path = write(ros, camera_rows(ros, [jpeg] * 40, gaps_ms=[0, 0, 700, 0, 5000]))
    with open_recording(path, require=("image",)) as recording:
        seen = []
        out = tmp_path / f"camera.{suffix}"
        written = write_video(recording, out, progress=lambda done, total: seen.append((done, total)))
        expected_s = (recording.image_times - recording.image_times[0]) / NS_PER_S
    found = packets(out)
    np.testing.assert_allclose([float(time) for time, _ in found], expected_s, atol=0.51 * exact_s)
    assert {data for _, data in found} == {jpeg}
    assert (written.frames, written.start, written.skipped) == (40, START_NS + 33_333_333, SkippedFrames())
    assert written.duration_s == pytest.approx(expected_s[-1])
    assert seen[-1] == (39, 40)
    assert [path.name for path in tmp_path.glob("*.part")] == []


def test_png_is_encoded_and_unusable_frames_are_skipped_with_warnings(ros1, write, jpeg, tmp_path):
    pytest.importorskip("av")
    import cv2

    png = cv2.imencode(".png", np.full((48, 64, 3), 90, dtype=np.uint8))[1].tobytes()
    other = cv2.imencode(".jpg", np.zeros((20, 30, 3), dtype=np.uint8))[1].tobytes()
    path = write(ros1, camera_rows(ros1, [jpeg, png, other, jpeg[:2] + bytes(50), jpeg]))
    with open_recording(path, require=("image",)) as recording:
        written = write_video(recording, tmp_path / "camera.mp4")
        assert [warning.code for warning in recording.warnings] == ["picture-sizes", "unreadable-pictures"]
        assert "neither JPEG nor PNG" in recording.warnings[1].facts["message"]
    assert (written.frames, written.skipped) == (3, SkippedFrames())
    assert [data[:2] for _, data in packets(tmp_path / "camera.mp4")] == [b"\xff\xd8"] * 3


def test_an_unsupported_suffix_or_a_missing_library_is_an_error_and_leaves_no_file(
    ros1, write, jpeg, tmp_path, monkeypatch
):
    path = write(ros1, camera_rows(ros1, [jpeg]))
    with open_recording(path, require=("image",)) as recording:
        with pytest.raises(InputError, match=r"unsupported video format; use \.mp4, \.mov, \.mkv"):
            write_video(recording, tmp_path / "camera.avi")
        with pytest.raises(FileNotFoundError):
            write_video(recording, tmp_path / "absent" / "camera.mp4")
        monkeypatch.setattr(video_writing, "find_spec", lambda name: None)
        with pytest.raises(InputError, match=r"needs PyAV, which is not installed: pip install 'cocalib\[video\]'"):
            write_video(recording, tmp_path / "camera.mp4")
    assert not list(tmp_path.glob("camera*"))
