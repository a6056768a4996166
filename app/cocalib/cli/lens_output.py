"""What `cocalib intrinsics` gives: a calibrated lens in words for the terminal, and files with intrinsics in every format."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

from calib_core.camera import Camera
from calib_core.errors import InputError, meant
from calib_core.intrinsics.board_images import LeftOutImage
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.coverage import BoardSearch, Coverage
from calib_core.intrinsics.image_maps import MODEL_ERRORS_UNSEEN, projection_uncertainty, residual_field
from calib_core.intrinsics.split_difference import split_difference
from calib_core.recordings import table_lines
from calib_core.words.intrinsics import halves_text, residuals_text
from calib_core.words.outcomes import in_sentences
from cocalib.intrinsics.field_of_view import field_of_view_text
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import print_exactly
from cocalib.view.wording import plain, sentence, with_sigma

CAMERA_SUFFIXES = (".yaml", ".yml", ".json", ".xml", ".cameramodel", ".txt", ".mat", ".npz", ".bin", ".conf")
_BY_SUFFIX = {".json": "json"}
DOUBTFUL = frozenset(
    {
        "large-residuals",
        "lens-folds-back",
        "little-covered",
        "principal-point-far",
        "several-series",
        "unequal-focal-lengths",
        "weak-focal-length",
    }
)
"""Warnings after which a lens should not be used unseen: the exit code is 3."""
_MOST_LEFT_OUT = 12


def _camera_lines(camera: Camera) -> Iterator[str]:
    """Yield the parameters of a camera, one a line, with their standard deviations if they are known."""
    yield f"model          {camera.model}, images of {camera.width_px} x {camera.height_px} px"
    known = camera.covariance
    for name, value in zip(camera.parameter_names, camera.parameters.tolist(), strict=True):
        unit = " px" if name.endswith("_px") else ""
        shown = plain(value, 6) if known is None else with_sigma(value, known.sigma(name))
        yield f"{name.removesuffix('_px'):<14} {shown}{unit}"
    yield f"field of view  {field_of_view_text(camera)}"


def lens_lines(lens: CalibratedLens, search: BoardSearch, coverage: Coverage, *, verbose: bool) -> Iterator[str]:
    """Yield what is known about a calibrated lens.

    Args:
        lens: with its views.
        search: in which they were found.
        coverage: of the used views.
        verbose: whether to list every view.
    """
    yield from _camera_lines(lens.camera)
    yield f"choice         {sentence(lens.choice)}"
    yield f"RMS            {lens.rms_px:.3f} px in the used views, {lens.held_out_rms_px:.3f} px in views left out in turn"
    yield f"views          {len(lens.views)} used, {len(lens.left_out)} left out, {search.searched} images searched"
    yield from _uncertainty_lines(lens)
    yield from _coverage_lines(coverage)
    if verbose:
        yield from _view_lines(lens)
    yield from left_out_lines(lens.left_out, most=len(lens.left_out) if verbose else _MOST_LEFT_OUT)
    yield from (f"warning: {in_sentences(warning)} [{warning.code}]" for warning in lens.warnings)


def left_out_lines(left_out: Sequence[LeftOutImage], *, most: int = _MOST_LEFT_OUT) -> Iterator[str]:
    """Yield the images that were not used, with the reasons; beyond so many lines, how many there are."""
    whole = most >= len(left_out)
    named = [image for image in left_out if whole or not image.spare]
    yield from (f"left out: {image.name}: {image.reason}" for image in named[:most])
    if len(named) > most:
        yield f"left out: {len(named) - most} more (--verbose names them)"
    if len(named) < len(left_out):
        yield f"left out: {len(left_out) - len(named)} good views that others make unnecessary (--verbose names them)"


def _uncertainty_lines(lens: CalibratedLens) -> Iterator[str]:
    sigmas = projection_uncertainty(lens).sigma_px
    middle = sigmas[sigmas.shape[0] // 2, sigmas.shape[1] // 2]
    corners = sigmas[[0, 0, -1, -1], [0, -1, 0, -1]].max()
    yield f"projection     known to {plain(middle, 2)} px in the middle of the image, {plain(corners, 2)} px in a corner"
    yield f"               {MODEL_ERRORS_UNSEEN}"
    yield f"cross-check    {halves_text(split_difference(lens))}"
    yield f"residuals      {residuals_text(residual_field(lens))}"


def _coverage_lines(coverage: Coverage) -> Iterator[str]:
    parts = [f"{100.0 * coverage.share:.0f} % of the image"]
    parts += [f"{name} {count}" for name, count in (*coverage.tilts.items(), *coverage.distances.items())]
    yield f"coverage       {', '.join(parts)}"
    yield from (f"film next      {sentence(one)}" for one in coverage.missing)


def _view_lines(lens: CalibratedLens) -> Iterator[str]:
    rows = [("view", "corners", "used", "RMS px", "leave-one-out px")]
    for view in lens.views:
        used, corners = int(view.used.sum()), len(view.used)
        rows.append((view.corners.name, f"{corners}", f"{used}", f"{view.rms_px:.3f}", f"{view.held_out_rms_px:.3f}"))
    yield from table_lines(rows, right=range(1, 5))


def convert_camera(path: Path, *, to: str | None, out: Path | None, size_px: tuple[int, int] | None) -> int:
    """Print the camera in a file, or write it in another format; return the exit code.

    Args:
        path: of the file; "file.yml#cam1" selects one of its cameras.
        to: format to write.
        out: file to write.
        size_px: width and height of images to which the camera is rescaled; None to keep its own.
    """
    from calib_core.interchange.cameras.files import CameraFile

    camera = CameraFile.read(path, rescale=size_px is not None).camera(image_size_px=size_px)
    if out is None and to is None:
        print("\n".join([f"{path}", *_camera_lines(camera)]))
        return 0
    write_camera(camera, to, out)
    return 0


def write_camera(camera: Camera, to: str | None, out: Path | None, *, told: TextIO | None = None) -> None:
    """Write a camera to a file, or to stdout without one.

    Args:
        camera: the intrinsics.
        to: format; None to take it from the suffix.
        out: the file.
        told: where it is said that it was written; None for stdout.

    Raises:
        InputError: the format cannot hold it.
    """
    from calib_core.interchange.cameras.files import camera_content

    content = camera_content(camera, camera_format(to, out))
    if out is not None:
        write_whole(out, content)
        print(f"written to {out}", file=told)
    else:
        print_exactly(content)


def require_format(to: str | None) -> None:
    """Refuse a format that does not exist.

    Raises:
        InputError: it does not; the message names those that do.
    """
    from calib_core.interchange.cameras.files import CAMERA_FORMATS

    if to is not None and to not in CAMERA_FORMATS:
        raise InputError(f"--to {to}: no such format for intrinsics; {meant(to, CAMERA_FORMATS)}")


def size_of(text: str) -> tuple[int, int]:
    """Return width and height as typed, such as 1280x720.

    Raises:
        InputError: that is no size.
    """
    match = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text)
    if not match or not (int(match[1]) and int(match[2])):
        raise InputError(f"--rescale {text}: give width and height of the images, such as 1280x720")
    return int(match[1]), int(match[2])


def camera_format(to: str | None, out: Path | None) -> str:
    """Return the format: as asked for, by the suffix of the file, else ROS camera_info YAML.

    Raises:
        InputError: the suffix is of a format that is read only.
    """
    if to is not None:
        return to
    suffix = "" if out is None else out.suffix.lower()
    if suffix in (".xml", ".mat", ".npz", ".cameramodel"):
        raise InputError(
            f"{out}: no intrinsics are written as {suffix}; name the file .yaml or .json, or give the format: --to opencv"
        )
    return _BY_SUFFIX.get(suffix, "ros")
