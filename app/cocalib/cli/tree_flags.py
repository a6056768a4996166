"""Flags about frame trees: which radar and which camera of several, and reading the tree of files and recordings."""

import dataclasses
import hashlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import tyro

from calib_core.errors import InputError
from calib_core.input_files import name_text
from cocalib.cli.flags import MORE, File, Switch, called
from cocalib.platform.files import keep, write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.geometry import RigidTransform
    from calib_core.interchange.calibration_file import CalibrationFile
    from calib_core.interchange.exporting import Export
    from calib_core.interchange.format import ImportedCalibration, PoseFor
    from calib_core.interchange.trees.frame_choice import WantedFrames
    from calib_core.interchange.trees.frame_tree import FrameTree
    from calib_core.interchange.trees.reading import TreeFile
    from calib_core.results import InputFile


@dataclass(frozen=True, slots=True)
class FrameFlags:
    """The names of the two frames."""

    radar: Annotated[str | None, called("NAME")] = None
    """The radar's frame: which one of a frame tree with several, or what to call it."""
    camera_frame: Annotated[str | None, called("NAME")] = None
    """The camera's frame: which one of a frame tree with several, or what to call it."""

    @property
    def wanted(self) -> "WantedFrames":
        """What the user names."""
        from calib_core.interchange.trees.frame_choice import WantedFrames

        return WantedFrames(self.radar, self.camera_frame)

    def files(self, paths: Sequence[Path]) -> "tuple[TreeFile, ...] | None":
        """Return the content of a calibration's files, each read once; None if they are a recording.

        Raises:
            InputError: one cannot be read, or a folder contains none.
        """
        if any(map(_holds_recording, paths)) and not _is_plain_mcap(paths):
            return None
        return _kept_files(paths)

    def read(
        self, paths: Sequence[Path], files: "tuple[TreeFile, ...] | None" = None
    ) -> "tuple[ImportedCalibration, tuple[InputFile, ...]]":
        """Read a calibration from one file, or from files, a folder or a recording that make one frame tree.

        Args:
            paths: of them.
            files: what `files` returned, if it was called.

        Returns:
            The calibration, and the files that it was read from; none for a recording.

        Raises:
            InputError: a path cannot be read, or there is no pose between a radar and a camera.
        """
        from calib_core.interchange.importing import read_together
        from calib_core.interchange.trees.posed_in_tree import calibration_in_tree

        found = self.files(paths) if files is None else files
        if found is None:
            source = ", ".join(map(str, paths))
            return calibration_in_tree(_tree_of(paths), self.wanted, source=source), ()
        return read_together(found, self.wanted), tuple(map(input_file, found))

    def renamed(self, file: "CalibrationFile") -> "CalibrationFile":
        """Return a calibration with its frames called as the user says; what is written names the calibration as it was.

        Raises:
            InputError: a name cannot be used.
        """
        from calib_core.interchange.calibration_file import FrameNames
        from calib_core.interchange.own.calibration_json import calibration_sha256

        known = file.frames
        frames = FrameNames(self.radar or known.radar, self.camera_frame or known.camera)
        if frames == known:
            return file
        return dataclasses.replace(file, frames=frames, made_from_sha256=calibration_sha256(file))


Frames: TypeAlias = Annotated[FrameFlags, tyro.conf.arg(name=""), MORE]


@dataclass(frozen=True, slots=True)
class TreeFlags:
    """Exports that fit into an existing frame tree."""

    into: Annotated[tuple[Path, ...], called("FILE...")] = ()
    """Solve for the free joint of this URDF, launch file, Autoware's two files or Apollo's folder; prints what would change."""
    joint: Annotated[str | None, called("NAME")] = None
    """With --into: the joint to solve for, by its name or its child frame; without it, the camera's mount."""
    write: Switch = False
    """With --into: change the file in place; with --out, the changed copy is written there instead."""
    tree: Annotated[tuple[Path, ...], called("FILE...")] = ()
    """Frames that exist already, such as the camera driver's: a URDF, a recording, what ros2 topic echo /tf_static printed."""

    def patch(
        self, file: "CalibrationFile", frames: FrameFlags, *, to: str, out: File, returns: "PoseFor | None"
    ) -> int:
        """Print what changes in the files of --into, or write it; return the exit code.

        Raises:
            InputError: the joint cannot be chosen or changed, or options contradict each other.
        """
        from calib_core.interchange.own.raw_data import for_raw
        from calib_core.interchange.trees.patching import patched

        if to != "list":
            raise InputError("--into changes an existing file, --to writes a new one; give one of them")
        files = _kept_files(self.into)
        known = _tree_of(self.tree).joints if self.tree else ()
        change = patched(files, known, for_raw(file) if returns == "raw" else file, frames.wanted, joint=self.joint)
        for line in (f"solved for {change.why}", *(f"note: {note}" for note in change.notes)):
            print(line, file=sys.stderr)
        if out is not None:
            target = out / Path(change.source).name if out.is_dir() else out
        elif self.write:
            target = Path(change.source)
        else:
            print_exactly(change.diff())
            print("nothing is written; --write changes the file, --out FILE writes a copy", file=sys.stderr)
            return 0
        write_whole(target, change.data, again=out is None)
        print(f"written to {target}")
        return 0

    def export(
        self,
        file: "CalibrationFile",
        to: str,
        *,
        parent_from_radar: "RigidTransform | None",
        rectified: bool,
        returns: "PoseFor | None",
    ) -> "Export":
        """Export a calibration to a format, beside the frames of --tree if there are any.

        Raises:
            InputError: the format cannot represent it, or it does not fit into the tree.
        """
        from calib_core.interchange.exporting import attached_export, export

        if self.joint is not None or self.write:
            raise InputError("--joint and --write are for --into FILE; give that too")
        if self.tree:
            return attached_export(file, to, _tree_of(self.tree), returns=returns)
        return export(file, to, parent_from_radar=parent_from_radar, rectified=rectified, returns=returns)


Trees: TypeAlias = Annotated[TreeFlags, tyro.conf.arg(name="")]


def input_file(file: "TreeFile") -> "InputFile":
    """Return what the provenance says of a file."""
    from calib_core.results import InputFile

    return InputFile(name_text(Path(file.source).name), len(file.data), hashlib.sha256(file.data).hexdigest())


def _kept_files(paths: Sequence[Path]) -> "tuple[TreeFile, ...]":
    """Read the files that make a frame tree; none of them is written over.

    Raises:
        InputError: one cannot be read, or a folder contains none.
    """
    from calib_core.interchange.importing import files_beside, tree_files

    files = tree_files(paths)
    for path in (Path(file.source) for file in files):
        keep((path, *(path.with_name(name) for name in files_beside(path))))
    return files


def _tree_of(paths: Sequence[Path]) -> "FrameTree":
    """Read the frame tree of files, folders and recordings together.

    Raises:
        InputError: a path cannot be read, has no transforms, or they make no tree.
    """
    from calib_core.interchange.format import WrittenPose
    from calib_core.interchange.trees.frame_tree import Joint, Place
    from calib_core.interchange.trees.reading import joined_tree
    from calib_core.recordings import frame_transforms

    recordings = [path for path in paths if _holds_recording(path)]
    files = _kept_files([path for path in paths if path not in recordings])
    joints: list[Joint] = []
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
            f"{recordings[0]}: a recording without /tf_static and /tf holds no calibration; give the file that does, and "
            "the recording to judge it on after it (evaluate) or with --recording (check)"
        )
    return joined_tree(files, joints)


def _is_plain_mcap(paths: Sequence[Path]) -> bool:
    """Return whether this is one MCAP file without transforms of ROS, such as an exported calibration."""
    from calib_core.recordings import frame_transforms

    return len(paths) == 1 and paths[0].suffix == ".mcap" and not frame_transforms(paths)


def _holds_recording(path: Path) -> bool:
    from calib_core.recordings import holds_recording

    return holds_recording(path)
