"""Flags about frame trees: which radar and which camera of several, and reading the tree of files and recordings."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import tyro

from app.cli.flags import called
from calib_core.errors import InputError
from calib_core.input_files import name_text

if TYPE_CHECKING:
    from calib_core.interchange import FrameTree, ImportedCalibration, WantedFrames
    from calib_core.results import InputFile

__all__ = ["FrameFlags", "Frames", "tree_of"]


@dataclass(frozen=True, slots=True)
class FrameFlags:
    """The names of the two frames."""

    radar_frame: Annotated[str | None, called("NAME")] = None
    """The radar's frame: which one of a frame tree with several, or what to call it."""
    camera_frame: Annotated[str | None, called("NAME")] = None
    """The camera's frame: which one of a frame tree with several, or what to call it."""

    @property
    def wanted(self) -> "WantedFrames":
        """What the user names."""
        from calib_core.interchange import WantedFrames

        return WantedFrames(self.radar_frame, self.camera_frame)

    def read(self, paths: Sequence[Path]) -> "tuple[ImportedCalibration, tuple[InputFile, ...]]":
        """Read a calibration from one file, or from files, a folder or a recording that make one frame tree.

        Returns:
            The calibration, and the files that it was read from; none for a recording.

        Raises:
            InputError: a path cannot be read, or there is no pose between a radar and a camera.
        """
        from calib_core.interchange import calibration_in_tree, read_together, tree_files
        from calib_core.results import InputFile

        if any(map(_holds_recording, paths)):
            source = ", ".join(map(str, paths))
            return calibration_in_tree(tree_of(paths), self.wanted, source=source), ()
        files = tree_files(paths)
        inputs = tuple(
            InputFile(name_text(Path(file.source).name), len(file.data), hashlib.sha256(file.data).hexdigest())
            for file in files
        )
        return read_together(files, self.wanted), inputs


Frames: TypeAlias = Annotated[FrameFlags, tyro.conf.arg(name="")]


def tree_of(paths: Sequence[Path]) -> "FrameTree":
    """Read the frame tree of files, folders and recordings together.

    Raises:
        InputError: a path cannot be read, has no transforms, or they make no tree.
    """
    from calib_core.interchange import Joint, Place, WrittenPose, joined_tree, tree_files
    from calib_core.recordings import frame_transforms

    recordings = [path for path in paths if _holds_recording(path)]
    files = tree_files([path for path in paths if path not in recordings])
    joints = []
    for path in recordings:
        for transform in frame_transforms([path]):
            place = Place(f"{path.name}, {transform.topic}")
            if transform.moves:
                problem = "it moves during the recording; give a frame that is fixed to the vehicle"
                joints.append(Joint(transform.parent, transform.child, None, place, problem=problem))
                continue
            written = WrittenPose(
                "quaternion_xyzw", transform.quaternion_xyzw, transform.translation_m, "radar_from_camera"
            )
            joints.append(Joint.posed(transform.parent, transform.child, written, place))
    if recordings and not joints:
        raise InputError(
            f"{recordings[0]}: has no /tf_static and no /tf; give the file with the frames, such as the URDF"
        )
    return joined_tree(files, joints)


def _holds_recording(path: Path) -> bool:
    from calib_core.recordings import holds_recording

    return holds_recording(path)
