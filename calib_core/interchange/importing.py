"""Read a calibration in any known format, and make a calibration-1 file of it with what it rests on."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import no_text, other_kind, read_input
from calib_core.interchange.calibration_file import (
    CalibrationFile,
    Evidence,
    FrameNames,
    Provenance,
    choose_check_point,
)
from calib_core.interchange.check.pair_residuals import CheckPairs
from calib_core.interchange.check.pixel_differences import lenses_of
from calib_core.interchange.check.report import CheckReport, check
from calib_core.interchange.format import TRUTH_FORMAT, ImportedCalibration
from calib_core.interchange.formats.registry import is_ours, reader_of, readers
from calib_core.interchange.statement import stated_origin
from calib_core.interchange.syntax.content import Content, readings
from calib_core.interchange.trees.frame_choice import WantedFrames
from calib_core.interchange.trees.posed_in_tree import calibration_in_tree, calibration_of_joints
from calib_core.interchange.trees.reading import TreeFile, read_tree
from calib_core.options import CalibrationOptions
from calib_core.radar import RadarErrors
from calib_core.results import Calibration, DataWarning, Metrics

_MAX_BYTES = 256 * 1024 * 1024
_MAX_BESIDE_BYTES = 1024 * 1024
_KNOWN = "docs/formats.md (Files and formats under Help) lists what is read"

_OF_FOLDERS = ("calib_velo_to_cam.txt", "images.txt")  # of KITTI and COLMAP, read with the file beside it
_OF_TREES = (
    "*.urdf",
    "*.xacro",
    "*calibration.yaml",
    "*extrinsics*.yaml",
    "*intrinsics*.yaml",
    "sensor.json",
    "calibrated_sensor.json",
)
_DEPTH = 4
_MOST_FILES = 300


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
    """Return the files of a folder to read, those that may contain joints by their names, or the file itself.

    Raises:
        InputError: the folder contains none, or very many.
    """
    if not path.is_dir():
        return (path,)
    for name in _OF_FOLDERS:
        if (path / name).is_file():
            return (path / name,)
    paths = sorted(_named_in(path, _DEPTH))
    if not paths:
        raise InputError(
            f"{path}: no file of frames in this folder (looked for {', '.join(_OF_TREES)}); give the files themselves"
        )
    if len(paths) > _MOST_FILES:
        raise InputError(f"{path}: {len(paths)} files that may contain frames; give the folder of one vehicle")
    return tuple(paths)


def _named_in(folder: Path, depth: int) -> Iterator[Path]:
    for path in sorted(folder.iterdir()):
        if path.is_dir():
            if depth > 1 and not path.name.startswith("."):
                yield from _named_in(path, depth - 1)
        elif any(path.match(pattern) for pattern in _OF_TREES):
            yield path


def files_beside(path: str | Path) -> Mapping[str, bytes]:
    """Return the files in the same folder that may complete a calibration, by name; those that cannot be read are left out."""
    found = {}
    for name in dict.fromkeys(name for reader in readers() for name in reader.beside):
        file = Path(path).parent / name
        if file.name == Path(path).name or not file.is_file():
            continue
        try:
            found[name] = read_input(file, max_bytes=_MAX_BESIDE_BYTES, is_what="a calibration")
        except InputError:
            continue
    return found


def calibration_bytes(path: str | Path) -> bytes:
    """Return the content of a file, for callers that need more of it than `read_any` returns.

    Raises:
        InputError: it cannot be read, or is too large for a calibration.
    """
    return read_input(Path(path), max_bytes=_MAX_BYTES, is_what="a calibration")


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
        chained = None if is_ours(reader) else calibration_of_joints(reading, frames, source=source)
        if chained is not None:
            return _with_origin(chained, reading)
        if reader is not None:
            return _with_origin(_renamed(reader.read(reading, source), frames), reading)
        seen.append(reading)
    raise _refusal(seen[-1], source)


def _renamed(imported: ImportedCalibration, wanted: WantedFrames) -> ImportedCalibration:
    """Call the frames of a file that is no tree as the user says."""
    if not wanted.is_given:
        return imported
    known = imported.frames or FrameNames()
    frames = FrameNames(wanted.radar or known.radar, wanted.camera or known.camera)
    return replace(imported, frames=frames, file=replace(imported.file, frames=frames) if imported.file else None)


def _with_origin(found: ImportedCalibration, content: Content) -> ImportedCalibration:
    """Add what the text says about the calibration that the file was made from, unless the reader found it in a key."""
    if found.file is not None or content.syntax == "bytes":
        return found
    origin = stated_origin(content.text)
    found = replace(found, for_raw=found.for_raw or origin.for_raw)
    if found.evidence is not None:
        return found
    return replace(found, evidence=origin.evidence, calibration_sha256=origin.calibration_sha256)


def _refusal(content: Content, source: str) -> InputError:
    """Return the error for a file that no format recognizes, with what is in it."""
    if content.syntax == "bytes":
        return InputError(f"{source}: {no_text(content.data, 'a calibration')}; {_KNOWN}")
    if content.syntax == "xml" and content.value is None:
        return InputError(f"{source}: XML with <{content.root.tag}>; expected OpenCV's <opencv_storage>")
    if not content.text.strip():
        return InputError(f"{source}: the file is empty; {_KNOWN}")
    value = content.value
    kind = "a list" if isinstance(value, list) else "text" if isinstance(value, str) else "one value"
    found = ", ".join(map(str, list(value)[:12])) if isinstance(value, dict) else kind
    if isinstance(value, dict) and (ours := other_kind(value.get("schema"), "a calibration")):
        return InputError(f"{source}: {ours}")
    return InputError(
        f"{source}: no pose of a camera and a radar in it that says what it means (found {found or 'nothing'}); give "
        "intrinsics with --camera FILE; of another pose, cocalib import FILE lists what its numbers may mean"
    )


_UNKNOWN = float("nan")
_SAME_LENS_PX = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Adoption:
    """A converted calibration, and what was found when it was checked.

    Attributes:
        file: the calibration-1 file.
        report: of the check; its verdict is never "wrong".
    """

    file: CalibrationFile
    report: CheckReport


def _check_found(
    imported: ImportedCalibration,
    source: str,
    *,
    camera: Camera | None = None,
    against: ImportedCalibration | None = None,
    pairs: CheckPairs | None = None,
) -> CheckReport:
    """Check what a reader found before it is converted.

    Args:
        imported: what `read_any` returned.
        source: the file's name, for error messages.
        camera: the intrinsics, if the file has none.
        against: a calibration of the same sensors that is known to be right.
        pairs: radar positions and the pixels where they were seen.

    Raises:
        InputError: the file is a simulation's ground truth, contradicts itself, or fails a check; the message names the slip.
    """
    if imported.format == TRUTH_FORMAT:
        raise InputError(
            f"{source}: is the ground truth of a simulation, not a calibration; compare with it: cocalib check FILE --against"
        )
    report = check(imported, camera=camera, against=against, pairs=pairs)
    for result in report.results:
        if result.level == "error":
            raise InputError(f"{source}: {result.message}; {result.hint}")
    return report


def _evidence(imported: ImportedCalibration, report: CheckReport, *, tested: bool) -> Evidence:
    """Return what an import rests on: reading alone never raises the level that a file states.

    Args:
        imported: what was read.
        report: of its check, which found no error.
        tested: whether it was held against pairs or another calibration.
    """
    proven = report.verdict == "right"
    if imported.evidence == "imported_assumed" and not tested:
        proven = False
    return "imported_proven" if proven else "imported_assumed"


def adoption(
    imported: ImportedCalibration,
    source: str,
    *,
    camera: Camera | None = None,
    provenance: Provenance | None = None,
    against: ImportedCalibration | None = None,
    pairs: CheckPairs | None = None,
    replace_camera: bool = False,
) -> Adoption:
    """Convert what a reader found to a calibration-1 file; calibration-1 keeps everything that it contains.

    Args:
        imported: what `read_any` returned.
        source: the file's name, for error messages.
        camera: the intrinsics, if the file has none.
        provenance: where the calibration comes from.
        against: a calibration of the same sensors that is known to be right: agreeing with it proves the meaning of the file.
        pairs: radar positions and the pixels where they were seen: fitting them proves it, too.
        replace_camera: use the given camera although the file states another.

    Raises:
        InputError: the file contradicts itself, fails a check, states another camera, or there is no camera.
    """
    if imported.file is not None and camera is not None:
        raise InputError(
            f"{source}: is calibration-1 and contains the camera it was solved with; omit the other camera"
        )
    report = _check_found(imported, source, camera=camera, against=against, pairs=pairs)
    tested = against is not None or pairs is not None
    if imported.file is not None:
        raised = tested and imported.file.rests_on == "imported_assumed" and report.verdict == "right"
        return Adoption(replace(imported.file, evidence="imported_proven") if raised else imported.file, report)
    known = _camera(imported, camera, source=source, replace_camera=replace_camera)
    calibration = _as_calibration(imported, source, camera=known)
    file = CalibrationFile(
        calibration,
        imported.frames or FrameNames(),
        choose_check_point(calibration),
        provenance or Provenance(),
        evidence=_evidence(imported, report, tested=tested),
    )
    return Adoption(file, report)


def _camera(imported: ImportedCalibration, given: Camera | None, *, source: str, replace_camera: bool) -> Camera:
    """Return the camera of the file or the given one, which must not contradict each other.

    Raises:
        InputError: they image the same rays more than half a pixel apart, or there is neither.
    """
    if given is not None and not replace_camera:
        _refuse_another_camera(imported, given, source=source)
    known = given or imported.camera
    if known is None and imported.matrix_px is not None:
        raise InputError(
            f"{source}: {imported.format} states the camera matrix but not the image size; give it with --image-size WIDTH "
            "HEIGHT, or give the intrinsics with --camera FILE"
        )
    if known is None:
        raise InputError(f"{source}: {imported.format} contains no camera; give its intrinsics with --camera FILE")
    return known


def _refuse_another_camera(imported: ImportedCalibration, given: Camera, *, source: str) -> None:
    """Refuse a given camera that images the rays of the file's camera elsewhere.

    A file with a camera matrix alone is for undistorted images; that matrix is compared.

    Raises:
        InputError: they image a ray more than half a pixel apart.
    """
    lenses = lenses_of(imported, ImportedCalibration("given", imported.pose, camera=given), None)
    lens = lenses.difference if lenses is not None else None
    if lens is None or lens.max_px <= _SAME_LENS_PX:
        return
    apart = "" if np.isnan(lens.max_px) else f", up to {lens.max_px:.3g} px apart"
    raise InputError(
        f"{source}: states a camera other than the given one ({lens.text}){apart}; omit --camera, or take the given one with "
        "--replace-camera"
    )


def adopted_calibration(imported: ImportedCalibration, source: str, *, camera: Camera) -> Calibration:
    """Return what a reader found as a calibration with a given camera; whatever the file does not state is unknown.

    Args:
        imported: what `read_any` returned.
        source: the file's name, for error messages and the warning.
        camera: the intrinsics to use.

    Raises:
        InputError: the file contradicts itself, or fails its own check point.
    """
    _check_found(imported, source, camera=camera)
    return _as_calibration(imported, source, camera=camera)


def _as_calibration(imported: ImportedCalibration, source: str, *, camera: Camera) -> Calibration:
    """Return what was read and checked as a calibration with a given camera."""
    assumed = tuple(DataWarning.reported("assumed", note, "verify this assumption") for note in imported.assumptions)
    return Calibration(
        camera_from_radar=imported.camera_from_radar,
        covariance=_covariance(imported),
        camera=camera,
        metrics=Metrics(),
        pairs=(),
        unpaired=(),
        warnings=(*assumed, _imported_warning(imported, source)),
        options=CalibrationOptions(),
        radar_errors=imported.file.calibration.radar_errors if imported.file else RadarErrors(),
        systematic_errors=imported.file.calibration.systematic_errors if imported.file else (),
        covariance_parts=imported.file.calibration.covariance_parts if imported.file else None,
    )


def _covariance(imported: ImportedCalibration) -> Matrix66:
    if imported.file is not None:
        return imported.file.calibration.covariance
    return np.full((6, 6), _UNKNOWN) if imported.covariance is None else imported.covariance


def _imported_warning(imported: ImportedCalibration, source: str) -> DataWarning:
    return DataWarning.reported(
        "imported",
        f"imported from {PurePath(source).name} ({imported.format}): its pairs and input data are unknown",
        "check it with cocalib open RECORDING --calibration FILE: click the reflector",
    )
