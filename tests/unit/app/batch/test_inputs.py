"""Everything that opening a recording reads is an input: its files, and those beside and above it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cocalib.batch.inputs import InputPath
from cocalib.batch.job import job_of
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.running_job import run_job

_OPENED = """
import os, sys
from pathlib import Path

root, given = Path(sys.argv[1]), [Path(one) for one in sys.argv[2:]]
opened = set()

def hook(event, arguments):
    if event == "open" and isinstance(arguments[0], (str, bytes, os.PathLike)):
        path = Path(os.path.abspath(os.fsdecode(arguments[0])))
        if path.is_relative_to(root) and path.is_file():
            opened.add(str(path))

from calib_core.recordings import open_recording, RecordingOptions
sys.addaudithook(hook)
with open_recording(given, RecordingOptions(confirm_assumptions=True), require=("image",)) as recording:
    recording.camera()
    recording.image(0)
print("\\n".join(sorted(opened)))
"""

_P2 = "P2: " + " ".join(["700", "0", "32", "0", "0", "700", "24", "0", "0", "0", "1", "0"]) + "\n"


def images(folder: Path, names: tuple[str, ...]) -> Path:
    """Write small images."""
    import cv2
    import numpy as np

    folder.mkdir(parents=True)
    for name in names:
        assert cv2.imwrite(str(folder / name), np.full((48, 64, 3), 80, dtype=np.uint8))
    return folder


def kitti_frames(root: Path) -> Path:
    folder = images(root / "set" / "image_2", ("000000.png", "000001.png"))
    (root / "set" / "calib").mkdir()
    for name in ("000000.txt", "000001.txt"):
        (root / "set" / "calib" / name).write_text(_P2)
    (root / "set" / "timestamps.txt").write_text("1760000000.0\n1760000000.1\n")
    return folder


def kitti_raw(root: Path) -> Path:
    folder = images(root / "day" / "drive" / "image_02" / "data", ("0.png", "1.png"))
    (folder.parent / "timestamps.txt").write_text("2026-01-01 10:00:00.000000000\n2026-01-01 10:00:00.100000000\n")
    (root / "day" / "calib_cam_to_cam.txt").write_text(_P2.replace("P2", "P_rect_02") + "S_rect_02: 64 48\n")
    return folder


def table_beside(root: Path) -> Path:
    folder = images(root / "camera", ("a.png", "b.png"))
    (root / "camera.csv").write_text("file,time_ns\na.png,1760000000000000000\nb.png,1760000000100000000\n")
    return folder


@pytest.mark.parametrize(("layout", "beside"), [(kitti_frames, 2), (kitti_raw, 2), (table_beside, 1)])
def test_what_opening_reads_is_an_input(layout, beside, tmp_path):
    given = layout(tmp_path)
    command = [sys.executable, "-c", _OPENED, str(tmp_path), str(given)]
    printed = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert printed.returncode == 0, printed.stderr
    opened = set(printed.stdout.split("\n")) - {""}
    inputs = {str(file.path) for file in InputPath("recording", given).files()}
    assert opened <= inputs
    assert len({path for path in opened if not Path(path).is_relative_to(given)}) >= beside


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_pipe_is_never_read_and_its_job_says_so(tmp_path):
    pipe = tmp_path / "drive.bag"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="is a named pipe"):
        InputPath("recording", pipe).files()
    job = job_of(ManifestRow("van", "1", (pipe,)))
    outcome = run_job(job, tmp_path / "out")
    assert outcome.status == "failed"
    assert "named pipe" in outcome.reason
