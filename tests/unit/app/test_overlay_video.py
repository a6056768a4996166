"""Overlay videos: frames at their times, marks where the lens projects the returns, and codecs that can be had."""

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.measurements import NS_PER_S, Box, TimeNs
from cocalib import overlay_video as writing
from cocalib.overlay_video import (
    OverlayOptions,
    Panels,
    draw_boxes,
    draw_clicks,
    draw_returns,
    time_text,
    write_overlay,
)
from cocalib.recorded_view import RecordedView, frame_blocks
from tests.recorded_view import boxes_around, nearest_rows, opened_view

GREY = 90


@pytest.fixture(scope="module")
def view(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RecordedView]:
    with opened_view(tmp_path_factory.mktemp("made")) as shown:
        yield shown


def composed(view: RecordedView, index: int, trail_scans: int = 0) -> np.ndarray:
    """Return one frame of the video, drawn over a grey image."""
    titles = ("a.json", "b.json")[: 1 if view.against is None else 2]
    panels = Panels(view, titles, trail_scans=trail_scans, size_px=(320, 240))
    block = next(block for block in frame_blocks(view.recording) if index - block.first < len(block.times_ns))
    panels.enter(block)
    image = np.full((240, 320, 3), GREY, np.uint8)
    return panels.compose(image, TimeNs(int(block.times_ns[index - block.first])))


def test_every_frame_is_in_the_video_at_its_recorded_time(view, tmp_path):
    av = pytest.importorskip("av", reason="the extra 'video' is not installed")
    path, done = tmp_path / "out.mp4", []
    written = write_overlay(view, path, OverlayOptions(("c.json",)), progress=lambda *now: done.append(now))
    expected_s = (view.recording.image_times - view.recording.image_times[0]) / NS_PER_S
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
    np.testing.assert_allclose([frame.time for frame in frames], expected_s, atol=1e-4)
    assert (written.video.frames, written.size_px) == (len(expected_s), (frames[0].width, frames[0].height))
    assert written.codec == "H.264"
    assert written.video.duration_s == pytest.approx(expected_s[-1])
    assert done[-1] == (len(expected_s) - 1, len(expected_s))
    assert np.abs(frames[3].to_ndarray(format="bgr24")[5:20, 5:20].astype(int) - GREY).max() <= 6
    assert [file.name for file in tmp_path.iterdir()] == ["out.mp4"]


def test_returns_are_drawn_where_the_lens_projects_them(view):
    index = 7  # long after the click
    time = int(view.recording.image_times[index])
    frame = composed(view, index)[:240]
    expected = view.calibration.reproject(nearest_rows(view.recording, time))
    changed = np.argwhere((frame != GREY).any(axis=2))
    assert len(changed)
    distance_px = np.linalg.norm(changed[:, None, ::-1] - expected[None], axis=2).min(axis=1)
    assert distance_px.max() < 8
    u_px, v_px = np.rint(expected[0]).astype(int)
    scan = view.recording.radar_scans_around([TimeNs(time)], 0.0)
    assert frame[v_px, u_px, ::-1].tolist() == view.colours.of(scan)[0].tolist()


def test_another_calibration_is_drawn_beside_it(view):
    turned = view.calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, 0.05, 0]))
    against = dataclasses.replace(view.calibration, camera_from_radar=turned)
    frame = composed(dataclasses.replace(view, against=against), 7)
    assert frame.shape[1] == 640
    np.testing.assert_array_equal(frame[:240, :320], composed(view, 7)[:240])
    right = np.argwhere((frame[:240, 320:] != GREY).any(axis=2)).mean(axis=0)[::-1]
    expected = against.reproject(nearest_rows(view.recording, int(view.recording.image_times[7])))
    np.testing.assert_allclose(right, expected[0], atol=2)


def test_trails_show_where_returns_were(view):
    index = 9  # one second into the second placement
    none, long = composed(view, index), composed(view, index, trail_scans=30)
    assert ((long != GREY).any(axis=2)).sum() > ((none != GREY).any(axis=2)).sum()


def test_clicks_stay_half_a_second_with_the_length_of_their_residual(view):
    pair = view.pairs[0]
    assert pair.image_time is not None
    clicked = int(np.searchsorted(view.recording.image_times, pair.image_time))
    unclicked = dataclasses.replace(view, pairs=())
    differs = [
        bool((composed(view, clicked + after) != composed(unclicked, clicked + after)).any()) for after in range(-1, 3)
    ]
    assert differs == [False, True, True, False]
    image = np.zeros((240, 320, 3), np.uint8)
    draw_clicks(image, np.array([[310.0, 100.0]]), np.array([[300.0, 110.0]]), ["c1"])
    assert image[60:100, 150:300].any(), "at the right edge the words are to the left of the mark"


def test_boxes_are_drawn_at_their_frames_only(view):
    boxed = dataclasses.replace(view, boxes=boxes_around(view.recording, (5,)))
    differs = [bool((composed(boxed, index) != composed(view, index)).any()) for index in (4, 5, 6)]
    assert differs == [False, True, False]
    image = np.zeros((240, 320, 3), np.uint8)
    draw_boxes(image, [Box(50.0, 60.0, 100.0, 120.0)], ("",))
    assert image[60, 75].any()
    assert not image[90, 75].any()


def test_static_returns_are_dots_and_moving_ones_triangles():
    image = np.zeros((720, 1280, 3), np.uint8)
    places = np.array([[100.0, 100.0], [200.0, 100.0]])
    draw_returns(image, places, np.array([[10, 20, 250], [10, 20, 250]]), np.array([True, False]))
    dot, triangle = ((image[80:120, left : left + 40] == (250, 20, 10)).all(axis=2) for left in (80, 180))
    assert dot[20, 20]
    assert triangle[20, 20]
    assert abs(int(dot[:20].sum()) - int(dot[21:].sum())) <= 4
    assert triangle[21:].sum() > triangle[:20].sum()


def test_without_h264_the_next_codec_is_used_and_without_any_that_is_said(view, tmp_path, monkeypatch):
    pytest.importorskip("av", reason="the extra 'video' is not installed")
    for name, label in (("mpeg4", "MPEG-4"), ("mjpeg", "Motion JPEG")):
        monkeypatch.setattr(writing, "_can_write", name.__eq__)
        assert write_overlay(view, tmp_path / f"{name}.mkv", OverlayOptions(("c.json",))).codec == label
    monkeypatch.setattr(writing, "_can_write", lambda _name: False)
    with pytest.raises(InputError, match="none of the codecs"):
        write_overlay(view, tmp_path / "out.mp4", OverlayOptions(("c.json",)))


def test_an_interrupted_video_leaves_nothing(view, tmp_path):
    pytest.importorskip("av", reason="the extra 'video' is not installed")

    def stop(done: int, _total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_overlay(view, tmp_path / "out.mp4", OverlayOptions(("c.json",)), progress=stop)
    assert list(tmp_path.iterdir()) == []
    start = TimeNs(1_700_000_000 * NS_PER_S + 5_000_000)
    assert time_text(TimeNs(start + 1_500_000_000), start).split("   ") == ["2023-11-14 22:13:21.505 UTC", "+1.50 s"]
