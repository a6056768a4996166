"""Read a calibration in any known format."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from calib_core.errors import InputError
from calib_core.input_files import read_input
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.formats.registry import is_ours, reader_of, readers
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.origin import stated_origin
from calib_core.interchange.syntax.content import Content, readings
from calib_core.interchange.trees.frame_choice import WantedFrames
from calib_core.interchange.trees.posed_in_tree import calibration_in_tree, chained_calibration
from calib_core.interchange.trees.reading import TreeFile, files_of_trees, read_tree

_MAX_BYTES = 256 * 1024 * 1024
_MAX_BESIDE_BYTES = 1024 * 1024
_KNOWN = (
    "known: calibration-1, static_transform_publisher in a command or launch file, URDF, Autoware, Apollo and "
    "stamped transforms, tf_echo, Kalibr with T_cam_radar, OpenCV with R and T, KITTI, nuScenes, DriveWorks, Foxglove, "
    "PJLab, direct_visual_lidar_calibration, easy_handeye, OpenLABEL, Scale, Segments.ai, Autoware.AI, TUM, COLMAP, mat, "
    "npz, matrix"
)

_OF_FOLDERS = ("calib_velo_to_cam.txt", "images.txt")  # of KITTI and COLMAP, read with the file beside it
_OTHERS = "; a pose that states nothing: cocalib import FILE lists what its numbers may mean"


def read_any_file(path: str | Path, frames: WantedFrames | None = None) -> ImportedCalibration:
    """Read a calibration from a file of any format in the registry, or from a folder with the files of one frame tree.

    Args:
        path: of the file or folder.
        frames: which radar and which camera, if there are several.

    Raises:
        InputError: the file cannot be read, or contains no pose.
    """
    return read_any_files((Path(path),), frames)


def read_any_files(paths: Sequence[Path], frames: WantedFrames | None = None) -> ImportedCalibration:
    """Read a calibration from one file of any format, or from several files, or a folder, that make one frame tree.

    Args:
        paths: at least one.
        frames: which radar and which camera, if there are several.

    Raises:
        InputError: a file cannot be read, or they contain no pose between a radar and a camera.
    """
    return read_together(tree_files(paths), frames)


def read_together(files: Sequence[TreeFile], frames: WantedFrames | None = None) -> ImportedCalibration:
    """Read a calibration from the content of one file of any format, or of several files that make one frame tree.

    Args:
        files: at least one.
        frames: which radar and which camera, if there are several.

    Raises:
        InputError: they contain no pose between a radar and a camera.
    """
    if len(files) == 1:
        return read_any(files[0].data, files[0].source, frames, beside=files_beside(files[0].source))
    source = ", ".join(file.source for file in files)
    return calibration_in_tree(read_tree(files), frames or WantedFrames(), source=source)


def tree_files(paths: Sequence[Path]) -> tuple[TreeFile, ...]:
    """Read the files that make a frame tree; of a folder, those whose names say that they belong to one.

    Raises:
        InputError: one cannot be read, or a folder contains none.
    """
    files = (file for path in paths for file in _files_at(path))
    return tuple(TreeFile(calibration_bytes(file), str(file)) for file in files)


def _files_at(path: Path) -> tuple[Path, ...]:
    """Return the files of a folder to read, or the file itself.

    Raises:
        InputError: the folder contains none, or very many.
    """
    whole = (path / name for name in _OF_FOLDERS if path.is_dir())
    first = next((file for file in whole if file.is_file()), None)
    return files_of_trees(path) if first is None else (first,)


def files_beside(path: str | Path) -> Mapping[str, bytes]:
    """Return the files in the same folder that may complete a calibration, by name; those that cannot be read are left out."""
    found = {}
    for name in dict.fromkeys(name for reader in readers() for name in reader.beside):
        file = Path(path).parent / name
        if file.name == Path(path).name or not file.is_file():
            continue
        try:
            found[name] = read_input(file, max_bytes=_MAX_BESIDE_BYTES, is_what="a calibration")
        except (OSError, InputError):
            continue
    return found


def calibration_bytes(path: str | Path) -> bytes:
    """Return the content of a file, for callers that need more of it than `read_any` returns.

    Raises:
        InputError: it cannot be read, or is too large for a calibration.
    """
    file = Path(path)
    try:
        return read_input(file, max_bytes=_MAX_BYTES, is_what="a calibration")
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error}); check the path") from None


def read_any(
    content: str | bytes,
    source: str = "calibration",
    frames: WantedFrames | None = None,
    *,
    beside: Mapping[str, bytes] | None = None,
) -> ImportedCalibration:
    """Read a calibration from the content of a file of any format in the registry; the content determines the format.

    Args:
        content: of the file.
        source: its name, for messages.
        frames: which radar and which camera, if there are several; in a file that is no tree, what to call them.
        beside: files in the same folder that may complete it, from `files_beside`.

    Raises:
        InputError: it contains no pose in a known format; the message says what was looked for.
    """
    try:
        return _read(content, source, frames or WantedFrames(), beside or {})
    except InputError as error:
        if str(error).startswith(f"{source}:"):
            raise
        raise InputError(f"{source}: {error}") from None  # FrameNames refuses a name without knowing the file


def _read(content: str | bytes, source: str, frames: WantedFrames, beside: Mapping[str, bytes]) -> ImportedCalibration:
    seen = []
    for syntax in readings(content, source=source):
        reading = replace(syntax, beside=beside)
        reader = reader_of(reading)
        chained = None if is_ours(reader) else chained_calibration(reading, frames, source=source)
        if chained is not None:
            return _with_origin(chained, reading)
        if reader is not None:
            return _with_origin(_renamed(reader.read(reading, source), frames), reading)
        seen.append(reading)
    raise _refusal(seen[-1], source)


def _renamed(found: ImportedCalibration, wanted: WantedFrames) -> ImportedCalibration:
    """Call the frames of a file that is no tree as the user says."""
    if not wanted.is_given:
        return found
    known = found.frames or FrameNames()
    frames = FrameNames(wanted.radar or known.radar, wanted.camera or known.camera)
    return replace(found, frames=frames, file=replace(found.file, frames=frames) if found.file else None)


def _with_origin(found: ImportedCalibration, content: Content) -> ImportedCalibration:
    """Add what the text says about the calibration that the file was made from, unless the reader found it in a key."""
    if found.file is not None or found.evidence is not None or content.syntax == "bytes":
        return found
    origin = stated_origin(content.text)
    return replace(found, evidence=origin.evidence, calibration_sha256=origin.calibration_sha256)


def _refusal(content: Content, source: str) -> InputError:
    """Return the error for a file that no format recognizes, with what is in it."""
    if content.syntax == "bytes":
        return InputError(f"{source}: neither text nor an archive; if it is text, save it as UTF-8; if not, {_KNOWN}")
    if content.syntax == "xml" and content.value is None:
        return InputError(f"{source}: XML with <{content.root.tag}>; expected OpenCV's <opencv_storage>")
    if content.syntax == "mcap":
        names = ", ".join(message.schema_name for message in content.mcap.messages[:12])
        return InputError(f"{source}: MCAP without foxglove.FrameTransforms (found {names or 'no message'}); {_KNOWN}")
    if not content.text.strip():
        return InputError(f"{source}: the file is empty; {_KNOWN}")
    value = content.value
    kind = "a list" if isinstance(value, list) else "text" if isinstance(value, str) else "one value"
    found = ", ".join(map(str, list(value)[:12])) if isinstance(value, dict) else kind
    return InputError(
        f"{source}: no pose of a camera and a radar in it (found {found or 'nothing'}); {_KNOWN}{_OTHERS}"
    )
