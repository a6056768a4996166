"""Write a simulated recording to a folder, in common containers."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeAlias

from calib_core.boxes import boxes_text, labels_text
from calib_core.lens_models.naming import written_lens
from calib_core.recordings.containers.writing import write_ros1_bag, write_ros2
from calib_core.synthetic.annotations import is_annotated, true_boxes, true_labels
from calib_core.synthetic.messages import all_messages, camera_messages, radar_messages
from calib_core.synthetic.options import Container
from calib_core.synthetic.plain_files import write_plain_files
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording
from calib_core.synthetic.truth import clicks_text, truth_text

Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number done and the total."""


def write_recording(
    recording: SimulatedRecording,
    folder: Path,
    containers: Sequence[Container] = ("ros1",),
    *,
    progress: Progress = lambda done, total: None,
) -> tuple[Path, ...]:
    """Write recording, truth.json and clicks.json, and return the data files.

    If people, robots or cars move that are worth judging, boxes.json and labels.json are written too.

    Args:
        recording: what to write.
        folder: created if it does not exist; existing files are not overwritten.
        containers: "ros1" writes radar.bag and camera.bag; "mcap" and "db3" write a ROS 2 bag each: a folder with
            metadata.yaml, whose data file can also be opened alone. "csv" and "jsonl" write a folder without ROS: pictures
            named by date, the radar as a table or as one JSON object per scan, and camera.yaml.
        progress: called after each frame with the number written and the total over all containers.

    Raises:
        RecordingError: a file already exists.
        InputError: ROS has no name for the camera's lens model.
    """
    camera = recording.camera
    written_lens(camera.lens, camera.distortion, "camera_info")  # refused before anything is written
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    frame_count = len(recording.stage.frame_times.header_ns)
    for number, container in enumerate(containers):
        frames = _counted(recording, progress, before=number * frame_count, total=len(containers) * frame_count)
        if container in ("csv", "jsonl"):
            written.extend(write_plain_files(recording, folder / f"recording_{container}", container, frames))
        elif container == "ros1":
            written.append(write_ros1_bag(folder / "radar.bag", radar_messages(recording, 1)))
            written.append(write_ros1_bag(folder / "camera.bag", camera_messages(recording, frames)))
        else:
            name = folder / f"recording_{container}"
            messages = all_messages(recording, 2, frames)
            written.append(write_ros2(name, messages, container="mcap" if container == "mcap" else "sqlite3"))
    (folder / "truth.json").write_text(truth_text(recording), encoding="utf-8")
    (folder / "clicks.json").write_text(clicks_text(recording), encoding="utf-8")
    if is_annotated(recording):
        (folder / "boxes.json").write_text(boxes_text(true_boxes(recording)), encoding="utf-8")
        (folder / "labels.json").write_text(labels_text(true_labels(recording)), encoding="utf-8")
    return tuple(written)


def _counted(recording: SimulatedRecording, progress: Progress, *, before: int, total: int) -> Iterator[SimulatedFrame]:
    for done, frame in enumerate(recording.frames(), start=before + 1):
        yield frame
        progress(done, total)
