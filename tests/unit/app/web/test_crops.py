"""Cut-outs of marks are kept beside the session: bounded, over a restart, and without harm where the file is damaged."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from calib_core.measurements import Stamp, TimeNs
from cocalib.web.crops import FILE, CropKey, Crops
from tests.image_recording import ImageRecording

NOISE = np.random.default_rng(3).integers(0, 255, (200, 300, 3), dtype=np.uint8)


class Counted(ImageRecording):
    """A recording that counts how often an image is read."""

    reads = 0

    def image_bytes(self, index: int) -> Any:
        self.reads += 1
        return super().image_bytes(index)


@pytest.fixture
def recording() -> Counted:
    return Counted([NOISE, NOISE, NOISE])


def key(recording: Counted, frame: int, u_px: float) -> CropKey:
    return (int(recording.image_times[frame]), u_px, 100.0, 96)


def made(recording: Counted, folder: Path, *keys: CropKey, most_bytes: int = 30_000_000) -> list[bytes]:
    """Return cut-outs of a program that starts, and ends."""
    crops: Any = Crops(recording, folder, most_bytes=most_bytes)
    waiting = [crops.thread.submit(crops.get, key) for key in keys]
    crops.thread.shutdown()
    crops.end()
    return [answer.result() for answer in waiting]


def test_a_cut_out_is_read_from_its_image_once_also_after_a_restart(recording, tmp_path):
    first = made(recording, tmp_path, key(recording, 1, 50.0), key(recording, 2, 60.0))
    assert recording.reads == 2
    assert made(recording, tmp_path, key(recording, 1, 50.0), key(recording, 2, 60.0)) == first
    assert recording.reads == 2
    with pytest.raises(KeyError):
        made(recording, tmp_path, (1, 50.0, 100.0, 96))


def test_the_file_stays_within_its_limit_and_loses_the_oldest_first(recording, tmp_path):
    keys = [key(recording, 0, 50.0 + column) for column in range(40)]
    size = len(made(recording, tmp_path, keys[0])[0])
    for at in range(0, 40, 5):
        made(recording, tmp_path, *keys[at : at + 5], most_bytes=20 * size)
        assert (tmp_path / FILE).stat().st_size <= 20 * size
    before = recording.reads
    made(recording, tmp_path, *keys[-5:], most_bytes=20 * size)
    assert recording.reads == before
    made(recording, tmp_path, keys[0], most_bytes=20 * size)
    assert recording.reads == before + 1


@pytest.mark.parametrize("damage", ["cut", "changed", "text", "link"])
def test_a_damaged_file_costs_nothing_but_time(recording, tmp_path, damage):
    keys = [key(recording, 1, 50.0), key(recording, 2, 60.0)]
    first = made(recording, tmp_path, *keys)
    file = tmp_path / FILE
    whole = file.read_bytes()
    if damage == "link":
        file.rename(tmp_path / "elsewhere")
        file.symlink_to(tmp_path / "elsewhere")
    else:
        changed = whole[:-9] + b"?" + whole[-8:]
        file.write_bytes({"cut": whole[:-40], "changed": changed, "text": b"not a cache\n" * 99}[damage])
    assert made(recording, tmp_path, *keys) == first
    assert recording.reads == 4
    if damage == "link":
        assert (tmp_path / "elsewhere").read_bytes() == whole
    else:
        assert file.read_bytes() == whole


def test_without_a_folder_cut_outs_are_made_all_the_same(recording, tmp_path):
    (crop,) = made(recording, tmp_path / "none", key(recording, 1, 50.0))
    assert crop[:2] == b"\xff\xd8"
    assert not (tmp_path / "none").exists()


def test_marks_are_cut_out_when_they_are_set(recording, tmp_path):
    rows = [
        SimpleNamespace(image_time=Stamp.of(TimeNs(int(recording.image_times[frame]))), u_px=50.004, v_px=100.0)
        for frame in range(3)
    ]
    crops: Any = Crops(recording, tmp_path)
    crops.keep_marks(SimpleNamespace(clicks=rows))
    while recording.reads < 3:
        crops.thread.submit(len, ()).result()
    crops.end()
    made(recording, tmp_path, *(key(recording, frame, 50.0) for frame in range(3)))
    assert recording.reads == 3
