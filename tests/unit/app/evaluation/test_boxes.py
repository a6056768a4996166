"""What --boxes takes: a file, a topic, or the word moving; anything else is refused with what there is."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

from calib_core.boxes import boxes_text, labels_text
from calib_core.errors import InputError
from calib_core.measurements import Box, Boxes, FrameBoxes, LabelledScan, RadarScans, ReturnLabels, TimeNs
from calib_core.recordings import Recording, inspect_recording
from calib_core.synthetic.rig import typical_camera
from cocalib.evaluation.boxes import find_boxes, find_labels
from cocalib.evaluation.evaluating import evidence_in
from tests.unit.recordings.box_messages import FIRST_FRAME_NS, recorded
from tests.unit.recordings.conftest import Ros, write_rows

FRAME = FrameBoxes(TimeNs(FIRST_FRAME_NS), (Box(1.0, 2.0, 30.0, 40.0, "person"),))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recording]:
    import cv2

    ros = Ros(2)
    image = bytes(cv2.imencode(".jpg", np.full((48, 64, 3), 90, dtype=np.uint8))[1])
    path = write_rows(tmp_path_factory.mktemp("drive") / "drive", ros, recorded(ros, image, "new"), "mcap")
    with inspect_recording(path) as opened:
        yield opened


def test_a_file_is_read_for_the_frames_of_the_recording_and_refused_for_images_of_another_size(recording, tmp_path):
    path = tmp_path / "boxes.json"
    path.write_text(boxes_text(Boxes((FRAME,), "anything", (64, 48))), encoding="utf-8")
    assert find_boxes(str(path), recording) == Boxes((FRAME,), "boxes.json", (64, 48))
    assert len(find_boxes("/boxes", recording)) == 3, "of a topic"
    path.write_text(boxes_text(Boxes((FRAME,), "anything", (1920, 1080))), encoding="utf-8")
    with pytest.raises(InputError, match="made on images of 1920 x 1080 px, the recorded ones have 64 x 48"):
        find_boxes(str(path), recording)


def test_the_word_moving_looks_at_the_images(recording):
    seen: list[tuple[int, int]] = []
    with pytest.raises(InputError, match="nothing moves in 8 frames"):
        find_boxes("moving", recording, progress=lambda done, total: seen.append((done, total)))

    assert seen[-1] == (8, 8)


@pytest.mark.parametrize("name", ["missing.json", "/detections", "a\0b", "x" * 5000])
def test_anything_else_is_refused_with_what_there_is(recording, name):
    with pytest.raises(InputError, match=r"neither a file nor a topic of .* \(its topics with boxes: /boxes\)"):
        find_boxes(name, recording)


class Keyframes:
    """A recording of which only every second half of a second was kept."""

    radar_times = 500_000_000 * np.arange(8)

    def radar_windows(self) -> Iterator[RadarScans]:
        raise AssertionError("nothing can be followed in it")

    def radar_scans_around(self, times: Sequence[TimeNs], around_s: float) -> RadarScans:
        raise AssertionError("nothing was clicked")


def test_keyframes_give_no_acc_and_say_how_far_apart_they_are():
    boxes = Boxes(
        tuple(replace(FRAME, image_time=TimeNs(int(time))) for time in Keyframes.radar_times), "boxes", (64, 48)
    )
    found = evidence_in(Keyframes(), replace(typical_camera("pinhole"), width_px=64, height_px=48), boxes=boxes)

    assert found.returns is None
    assert [one.code for one in found.warnings] == ["sparse-frames"]
    facts = found.warnings[0].facts
    assert facts["apart_s"] / facts["longest_s"] == pytest.approx(1.5, abs=0.01)


def test_labels_are_read_or_refused_in_words(tmp_path):
    labels = ReturnLabels((LabelledScan(TimeNs(5), ("", "p1")),), "labels.json")
    path = tmp_path / "labels.json"
    with pytest.raises(InputError, match="no such file or folder"):
        find_labels(path)
    path.write_text(labels_text(labels), encoding="utf-8")
    assert find_labels(path) == labels
    for content, words in ((b"\xff\xfe\0", "not a text file"), (b"{}", "schema")):
        path.write_bytes(content)
        with pytest.raises(InputError, match=words):
            find_labels(path)
