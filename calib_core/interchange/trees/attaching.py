"""Export a static transform beside an existing frame tree: to the root of the camera's own chain, never a second parent."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.exporting import Export, export
from calib_core.interchange.formats.ros.launch_files import write_python
from calib_core.interchange.formats.ros.static_transform import ChildFrame, second_parent_notes
from calib_core.interchange.formats.ros.tf2_command import write_command
from calib_core.interchange.formats.ros.urdf import write_joint
from calib_core.interchange.trees.frame_tree import FrameTree

_WRITERS: Mapping[str, Callable[[CalibrationFile, ChildFrame], str]] = {
    "tf2": write_command,
    "tf2-launch-py": write_python,
    "urdf": write_joint,
}


def attached_export(file: CalibrationFile, name: str, tree: FrameTree) -> Export:
    """Export a calibration for use beside a frame tree.

    If the camera's frame has a parent there, the transform leads from the radar to the root of its chain, such as the
    camera_link of its driver.

    Args:
        file: what to export.
        name: of a format that publishes or describes frames.
        tree: of the robot, its driver or a recording.

    Raises:
        InputError: the format has no frames, or radar and camera are already connected in the tree.
    """
    if name not in _WRITERS:
        raise InputError(
            f"--tree is for formats that add a joint to a frame tree ({', '.join(_WRITERS)}), not {name}; omit it"
        )
    plain = export(file, name)
    radar, camera = file.frames.radar, file.frames.camera
    if camera not in tree.frames:
        near = f"the tree has no frame {camera}, so it becomes a new one; if it has another name there, give --camera-frame"
        return replace(plain, notes=(*plain.notes, near))
    root = tree.root_of(camera)
    if radar in tree.frames and tree.root_of(radar) == root:
        way = "; ".join(str(step.joint) for step in tree.path(radar, camera))
        raise InputError(
            f"{radar} and {camera} are already connected ({way}), and another transform would give a frame a second parent; "
            "change a joint of that tree instead: cocalib export CALIBRATION.json --into FILE"
        )
    if root == camera:
        return plain
    content = _WRITERS[name](file, ChildFrame(root, tree.between(root, camera)))
    note = (
        f"{camera} already has a parent, {tree.root_of(camera)} is the root of its chain: the transform leads from {radar} to "
        f"{root}, and the chain below it stays its driver's"
    )
    notes = tuple(one for one in plain.notes if one not in second_parent_notes(file))
    return Export(plain.file_name, content, (*notes, note))
