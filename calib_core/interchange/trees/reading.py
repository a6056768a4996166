"""Read the frame tree in one file, several files or a folder: URDF, transforms of ROS, Autoware, Apollo, nuScenes, rigs."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from calib_core.errors import InputError
from calib_core.interchange.syntax.content import Content, decoded, readings
from calib_core.interchange.trees.autoware import read_autoware, recognizes_autoware
from calib_core.interchange.trees.driveworks import read_driveworks, recognizes_driveworks
from calib_core.interchange.trees.easy_handeye import read_easy_handeye, recognizes_easy_handeye
from calib_core.interchange.trees.foxglove import read_foxglove, recognizes_foxglove
from calib_core.interchange.trees.frame_tree import FrameTree, Joint, Sensor, TreePart, joined
from calib_core.interchange.trees.nuscenes import (
    read_nuscenes,
    read_nuscenes_alone,
    recognizes_nuscenes,
    recognizes_poses,
    recognizes_sensors,
)
from calib_core.interchange.trees.openlabel import read_openlabel, recognizes_openlabel
from calib_core.interchange.trees.pjlab import read_extrinsics, recognizes_extrinsics
from calib_core.interchange.trees.publishers import read_publishers, recognizes_publishers
from calib_core.interchange.trees.stamped import read_stamped, recognizes_stamped
from calib_core.interchange.trees.tf_echo import read_tf_echo, recognizes_tf_echo
from calib_core.interchange.trees.urdf import read_urdf, recognizes_urdf


@dataclass(frozen=True, slots=True)
class TreeFile:
    """A file as it was read.

    Attributes:
        data: its bytes.
        source: its name, for messages.
    """

    data: bytes
    source: str

    @property
    def text(self) -> str:
        """Its text, as it is written.

        Raises:
            InputError: it is not text.
        """
        return decoded(self.data, source=self.source)


JOINTS: tuple[tuple[Callable[[Content], bool], Callable[[Content, str], TreePart]], ...] = (
    (recognizes_urdf, lambda content, source: read_urdf(content.text, source)),
    (recognizes_publishers, read_publishers),
    (recognizes_stamped, lambda content, source: read_stamped(content.text, source)),
    (recognizes_autoware, lambda content, source: read_autoware(content.text, source)),
    (recognizes_driveworks, read_driveworks),
    (recognizes_easy_handeye, read_easy_handeye),
    (recognizes_extrinsics, read_extrinsics),
    (recognizes_tf_echo, read_tf_echo),
    (recognizes_openlabel, read_openlabel),
    (recognizes_foxglove, read_foxglove),
    (recognizes_nuscenes, read_nuscenes_alone),
)
"""How each format with joints is recognized and read."""


def tree_in(content: Content, source: str) -> TreePart | None:
    """Return the joints of one file that needs no other; None if it contains no joints.

    Raises:
        InputError: it contains joints that cannot be read.
    """
    for recognizes, read in JOINTS:
        if recognizes(content):
            return read(content, source)
    return None


def read_tree(files: Sequence[TreeFile]) -> FrameTree:
    """Read the frame tree that files say together.

    Args:
        files: each with joints, except sensor.json of nuScenes and Apollo's intrinsics, which say which frames are cameras.

    Raises:
        InputError: a file contains no joints, or the joints make no tree.
    """
    return joined_tree(files, ())


def joined_tree(files: Sequence[TreeFile], recorded: Sequence[Joint]) -> FrameTree:
    """Read the frame tree that files and a recording say together.

    A joint that was recorded is left out if a file poses the same frame in the same parent: the file is what is edited.

    Args:
        files: as for `read_tree`; may be empty.
        recorded: the joints of the recording.

    Raises:
        InputError: a file contains no joints, or the joints make no tree.
    """
    parts: list[TreePart] = []
    tables: dict[str, Content] = {}
    poses: list[tuple[Content, str]] = []
    for file in files:
        for content in readings(file.data, source=file.source):
            if recognizes_sensors(content):
                tables[str(Path(file.source).parent)] = content
            elif recognizes_poses(content):
                poses.append((content, file.source))
            else:
                whole = replace(content, text=file.text.lstrip("\ufeff"))
                part = tree_in(whole, file.source) or cameras_named_in(content)
                if part is None:
                    continue
                parts.append(part)
            break
        else:
            raise InputError(
                f"{file.source}: no transforms between frames in it; leave it out, or give the file that has them"
            )
    parts += _posed_by_tables(poses, tables)
    posed = {(joint.parent, joint.child) for part in parts for joint in part.joints}
    parts.append(TreePart("tf2", tuple(one for one in recorded if (one.parent, one.child) not in posed)))
    if not any(part.joints for part in parts):
        raise InputError(
            f"{', '.join(file.source for file in files)}: no transforms between frames; give the files with them"
        )
    return joined(sorted(parts, key=lambda part: not part.joints))


def _posed_by_tables(poses: list[tuple[Content, str]], tables: Mapping[str, Content]) -> Iterator[TreePart]:
    for content, source in poses:
        beside = tables.get(str(Path(source).parent))
        table = beside or (next(iter(tables.values())) if len(tables) == 1 else None)
        yield read_nuscenes(content, source, table)


def cameras_named_in(content: Content) -> TreePart | None:
    """Return the camera whose frame a CameraInfo in YAML names; None if it is no such file.

    A CameraInfo is about the optical frame; Apollo's files, too, pose that one.
    """
    info = content.mapping
    header = info.get("header")
    if content.syntax != "yaml" or not ({"K", "D"} <= set(info) or {"k", "d"} <= set(info)):
        return None
    frame = header.get("frame_id") if isinstance(header, dict) else info.get("frame_id")
    if not isinstance(frame, str) or not frame.strip():
        return TreePart("camera_info", ())
    return TreePart("camera_info", (), (Sensor(frame.strip().lstrip("/"), "camera", "optical"),))
