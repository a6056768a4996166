"""What is written for Rerun is read back with Rerun's own reader and compared with the recording and its calibration."""

import dataclasses
import errno
import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.file_tag import OTHER_KIND, TAG, kind_of
from cocalib.platform import files
from cocalib.recorded_view import RecordedView
from cocalib.rerun import write_view, writing
from tests.recorded_view import boxes_around, nearest_rows, opened_view


class Read:
    """The rows of a written file by entity, in order of time."""

    def __init__(self, path: Path) -> None:
        from rerun.chunk import RrdReader

        self.chunks = list(RrdReader(path).stream())

    def column(self, entity: str, component: str, *, static: bool = False) -> dict[int, Any]:
        """Return the values of a component by their stamps; by 0 if it has no time."""
        found: dict[int, Any] = {}
        for chunk in self.chunks:
            batch = chunk.to_record_batch()
            if chunk.entity_path != f"/{entity}" or chunk.is_static != static or component not in batch.schema.names:
                continue
            times = [0] if static else np.asarray(batch.column("recorded").cast("int64")).tolist()
            found |= dict(zip(times, batch.column(component), strict=True))
        return dict(sorted(found.items()))

    def one(self, entity: str, component: str) -> Any:
        """Return the only value of a component that has no time."""
        return self.column(entity, component, static=True)[0].as_py()


@pytest.fixture(scope="module")
def view(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RecordedView]:
    pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
    with opened_view(tmp_path_factory.mktemp("made")) as shown:
        boxes = boxes_around(shown.recording, (3, 4))
        turned = shown.calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, 0.03, 0]))
        against = dataclasses.replace(shown.calibration, camera_from_radar=turned)
        yield dataclasses.replace(shown, boxes=boxes, against=against)


@pytest.fixture(scope="module")
def read(view: RecordedView, tmp_path_factory: pytest.TempPathFactory) -> Read:
    path = tmp_path_factory.mktemp("written") / "view.rrd"
    done: list[tuple[int, int]] = []
    written = write_view(view, path, progress=lambda *now: done.append(now))
    frames = len(view.recording.image_times)
    assert (written.frames, written.scans, written.skipped.unreadable) == (frames, len(view.recording.radar_times), 0)
    assert done[-1] == (frames, frames)
    return Read(path)


def test_images_are_the_recorded_bytes_at_their_recorded_times(read, view):
    blobs = read.column("radar/camera/image", "EncodedImage:blob")
    assert list(blobs) == view.recording.image_times.tolist()
    for index, blob in enumerate(blobs.values()):
        assert bytes(blob.as_py()[0]) == view.recording.image_bytes(index).data
    kinds = read.column("radar/camera/image", "EncodedImage:media_type")
    assert {kind.as_py()[0] for kind in kinds.values()} == {"image/jpeg"}


def test_the_camera_stands_where_the_calibration_says(read, view):
    for entity, calibration in (("radar/camera", view.calibration), ("radar/against", view.against)):
        pose = calibration.camera_from_radar.inverse()
        columns = np.array(read.one(entity, "Transform3D:mat3x3")[0]).reshape(3, 3)
        np.testing.assert_allclose(columns.T, pose.rotation, atol=1e-6)
        np.testing.assert_allclose(read.one(entity, "Transform3D:translation")[0], pose.translation_m, atol=1e-6)


def test_the_frustum_has_the_camera_matrix_in_reruns_pixels(read, view):
    matrix = np.array(read.one("radar/camera/image", "Pinhole:image_from_camera")[0]).reshape(3, 3).T
    camera = view.calibration.camera
    np.testing.assert_allclose(matrix[:2, :2], camera.matrix_px[:2, :2], rtol=1e-6)
    np.testing.assert_allclose(matrix[:2, 2], camera.matrix_px[:2, 2] + 0.5, rtol=1e-6)
    assert read.one("radar/camera/image", "Pinhole:resolution")[0] == [camera.width_px, camera.height_px]


@pytest.mark.parametrize("name", ["returns", "returns_against"])
def test_returns_lie_where_the_lens_of_the_calibration_projects_them(read, view, name):
    calibration = view.calibration if name == "returns" else view.against
    assert calibration is not None
    points = read.column(f"radar/camera/image/{name}", "Points2D:positions")
    assert list(points) == view.recording.image_times.tolist()
    drawn = 0
    for time, positions in list(points.items())[::7]:
        points_camera = calibration.camera_from_radar @ calibration.radar_errors.corrected(
            nearest_rows(view.recording, time)
        )
        expected = calibration.camera.project(points_camera[calibration.camera.sees(points_camera)]) + 0.5
        np.testing.assert_allclose(np.array(positions.as_py()).reshape(-1, 2), expected, atol=1e-3)
        drawn += len(expected)
    assert drawn > 5
    assert view.calibration.camera.is_distorted


def test_the_radar_cloud_has_every_return_of_every_scan(read, view):
    clouds = read.column("radar/returns", "Points3D:positions")
    scans = view.recording.radar_scans()
    assert list(clouds) == scans.times_ns.tolist()
    found = np.concatenate([np.array(cloud.as_py()) for cloud in clouds.values()])
    np.testing.assert_allclose(found, scans.points_radar_m, atol=1e-5)


def test_residuals_over_time_are_those_of_the_pairs(read, view):
    residuals = read.column("metrics/residual_px", "Scalars:scalars")
    expected = {int(pair.image_time): pair.distance_px for pair in view.pairs if pair.image_time is not None}
    assert {time: value.as_py()[0] for time, value in residuals.items()} == pytest.approx(expected)
    line = [value.as_py()[0] for value in read.column("metrics/aed_px", "Scalars:scalars").values()]
    assert line == pytest.approx([view.calibration.metrics.aed_px] * 2)


def test_a_click_is_shown_in_its_frame_only(read, view):
    clicked = {int(pair.image_time): pair for pair in view.pairs if pair.image_time is not None}
    clicks = read.column("radar/camera/image/clicked_now/click", "Points2D:positions")
    assert set(clicks) == set(clicked)
    for time, place in clicks.items():
        np.testing.assert_allclose(place.as_py()[0], clicked[time].pixel_px + 0.5, atol=1e-4)
    times = view.recording.image_times.tolist()
    cleared = set(read.column("radar/camera/image/clicked_now", "Clear:is_recursive"))
    assert {times[times.index(time) + 1] for time in clicked} <= cleared
    assert not cleared & set(clicked)


def test_boxes_end_with_the_last_annotated_frame(read, view):
    centres = read.column("radar/camera/image/boxes", "Boxes2D:centers")
    counts = [len(centre.as_py()) for centre in centres.values()]
    assert [index for index, count in enumerate(counts) if count] == [3, 4]
    time = int(view.recording.image_times[3])
    assert centres[time].as_py() == [[80.75, 100.5]]
    assert read.column("radar/camera/image/boxes", "Boxes2D:labels")[time].as_py() == ["person-1"]


def test_the_summary_is_plain_text_so_that_no_name_can_fetch_a_image(read, view):
    from cocalib.rerun.unmoving import summary_text

    assert read.one("summary", "TextDocument:media_type") == ["text/plain"]
    text = read.one("summary", "TextDocument:text")[0]
    assert text == summary_text(view)
    assert "AED" in text
    assert {name for chunk in read.chunks for name in chunk.timeline_names} == {"recorded"}


def test_an_interrupted_file_leaves_the_old_one_and_nothing_else(view, tmp_path):
    path, old = tmp_path / "view.rrd", f"old, {TAG}"
    path.write_text(old)

    def stop(_done: int, _total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_view(view, path, progress=stop)
    assert [file.name for file in tmp_path.iterdir()] == ["view.rrd"]
    assert path.read_text() == old


@pytest.mark.parametrize("room_bytes", [0, 30_000])
def test_a_disk_that_fills_up_ends_it_and_leaves_nothing(view, tmp_path, monkeypatch, room_bytes):
    class Full(io.BufferedWriter):
        def write(self, data):
            if self.tell() + len(data) > room_bytes:
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(data)

    @contextmanager
    def small(path):
        with files.whole_path(path) as part, Full(io.FileIO(part, "w")) as file:
            yield file

    monkeypatch.setattr(writing, "writing_whole", small)
    with pytest.raises(InputError):
        write_view(view, tmp_path / "view.rrd")
    assert list(tmp_path.iterdir()) == []
    assert [one.name for one in threading.enumerate() if "_copy" in one.name] == []


def test_a_written_file_is_known_as_ours_and_is_whole(view, tmp_path):
    from rerun.chunk import RrdReader

    path = tmp_path / "view.rrd"
    write_view(view, path)
    assert len(RrdReader(path).recordings()) == 1
    assert kind_of(path.read_bytes()[:1000]) == OTHER_KIND
    with pytest.raises(InputError):
        write_view(view, tmp_path / "absent" / "view.rrd")
