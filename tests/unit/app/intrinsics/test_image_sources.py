"""Images of a board come from a recording, a video, a folder or files, in a stable order."""

import cv2
import numpy as np
import pytest

from calib_core.errors import InputError
from cocalib.intrinsics import open_images
from cocalib.intrinsics.image_sources import images_in


def grey(value: int) -> np.ndarray:
    return np.full((48, 64, 3), value, dtype=np.uint8)


def test_images_of_a_folder_need_no_times_and_are_in_the_order_of_their_numbers(tmp_path):
    for number in (10, 2, 1):
        cv2.imwrite(str(tmp_path / f"shot{number}.png"), grey(number))
    (tmp_path / "notes.txt").write_text("nothing")
    with open_images([tmp_path]) as images:
        assert [images.name(index) for index in range(len(images))] == ["shot1.png", "shot2.png", "shot10.png"]
        assert [images.image(index)[0, 0, 0] for index in range(3)] == [1, 2, 10]
        assert images.time_ns(0) is None
        before = images.digest()
    cv2.imwrite(str(tmp_path / "shot2.png"), grey(3))
    with open_images(images_in(tmp_path)) as images:
        assert images.digest() != before


def test_a_video_needs_no_start_and_gives_its_frames_in_any_order(tmp_path):
    path = tmp_path / "board.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for value in range(0, 240, 8):
        writer.write(grey(value))
    writer.release()
    with open_images([path]) as images:
        assert len(images) == 30
        order = [0, 2, 1, 3, 29, 5, 4, 20, 0]
        shown = [float(images.image(index).mean()) / 8.0 for index in order]
        assert np.allclose(shown, order, atol=0.4)
        assert images.name(20) == "frame 21 (2.00 s)"


def test_files_with_equal_names_are_told_apart_by_their_folders(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        cv2.imwrite(str(tmp_path / folder / "1.png"), grey(5))
    with open_images([tmp_path / "*" / "1.png"]) as images:
        assert [images.name(0), images.name(1)] == ["a/1.png", "b/1.png"]


def test_a_file_that_is_no_image_is_an_error_of_its_own(tmp_path):
    (tmp_path / "broken.png").write_bytes(b"no image")
    cv2.imwrite(str(tmp_path / "good.png"), grey(5))
    with open_images([tmp_path]) as images:
        assert images.image(1).shape == (48, 64, 3)
        with pytest.raises(InputError, match="not an image that can be decoded"):
            images.image(0)
