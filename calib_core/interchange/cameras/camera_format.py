"""A format for the intrinsics of a camera, and what a reader finds in a file."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from calib_core.camera import Camera, CameraCovariance
from calib_core.errors import InputError
from calib_core.file_tag import TAG
from calib_core.interchange.format import ImportedCalibration
from calib_core.lens_models.registry import LENS_MODELS, lenses_named, opencv_lens


@dataclass(frozen=True, slots=True)
class ImageWindow:
    """The part of the sensor that was published, and how it was binned (REP 104).

    Attributes:
        offset_px: left column and upper row of the region of interest, on the full sensor.
        size_px: its width and height on the full sensor; None for all of it.
        binning: pixels of the sensor along a row and a column that make one of the image.
    """

    offset_px: tuple[int, int] = (0, 0)
    size_px: tuple[int, int] | None = None
    binning: tuple[int, int] = (1, 1)


@dataclass(frozen=True, slots=True, eq=False)
class FoundCamera:
    """What a file says about one camera, before any check.

    Attributes:
        name: its key in the file.
        model: our name for its lens model; "" if the file implies it by the number of coefficients.
        matrix_px: (9,) row-major.
        distortion: the coefficients, as many as the file has.
        size_px: width and height; None if the file does not state them.
        covariance: of the parameters; None if the file does not state it.
        window: the part of the image that was recorded; None for all of it.
        refused: why this camera cannot be used, if others of the file may be; "" if it can.
    """

    name: str
    model: str
    matrix_px: tuple[float, ...]
    distortion: tuple[float, ...]
    size_px: tuple[int, int] | None
    covariance: CameraCovariance | None = None
    window: ImageWindow | None = None
    refused: str = ""

    def camera(self, *, image_size_px: tuple[int, int] | None, source: str) -> Camera:
        """Return the camera, for the images as they were recorded.

        Raises:
            InputError: the camera is refused, the image size is missing, or a parameter is invalid.
        """
        if self.refused:
            raise InputError(self.refused)
        size = self.size_px or image_size_px
        if size is None:
            raise InputError(
                f"{source}: {self.name}: the image size is missing; add image_width and image_height to the file"
            )
        model, distortion = self.lens(source=source)
        matrix = np.reshape(self.matrix_px, (3, 3))
        if self.size_px is None:
            refuse_another_size(matrix, size, f"{source}: {self.name}")
        try:
            camera = Camera(model, *size, matrix, np.array(distortion), self.covariance)
            if self.window is None:
                return camera
            return camera.windowed(self.window.offset_px, self.window.size_px or size, self.window.binning)
        except ValueError as error:
            raise InputError(f"{source}: {self.name}: {error}; correct it or calibrate the camera again") from None

    def lens(self, *, source: str) -> tuple[str, tuple[float, ...]]:
        """Return the lens model and its coefficients: an unnamed model follows from their number as in OpenCV.

        Raises:
            InputError: the camera is refused, or the model does not take that number of coefficients.
        """
        if self.refused:
            raise InputError(self.refused)
        distortion = self.distortion
        lens = LENS_MODELS[self.model] if self.model else opencv_lens(len(distortion))
        if not distortion:  # ROS also calls a pinhole plumb_bob
            lens = next((bare for bare in lenses_named("camera_info", lens.name) if 0 in bare.counts), lens)
        longest = lens.counts[-1]
        if len(distortion) > longest and not any(distortion[longest:]):
            distortion = distortion[:longest]
        if len(distortion) not in lens.counts:
            wanted = " or ".join(map(str, lens.counts))
            raise InputError(
                f"{source}: {self.name}: {lens.name} takes {wanted} distortion coefficients, found {len(distortion)} "
                "(thin prism and tilt are not supported); calibrate the camera with that model"
            )
        return lens.name, distortion


_OFF_CENTRE = 0.1
"""How far off its middle, as a share of the image, a principal point shows that the image had another size."""
_ALIKE = 0.06


def refuse_another_size(matrix_px: np.ndarray, size_px: tuple[int, int], where: str) -> None:
    """Refuse a matrix whose principal point is as far off the middle along the columns as along the rows.

    Args:
        matrix_px: (3, 3), from a file that states no size.
        size_px: width and height of the images it is to be used for.
        where: the start of the message.

    Raises:
        InputError: it is, so the lens was calibrated in images of another size.
    """
    across, down = (matrix_px[:2, 2] + 0.5) / size_px
    if min(abs(across - 0.5), abs(down - 0.5)) > _OFF_CENTRE and abs(across - down) < _ALIKE:
        scale = across + down
        raise InputError(
            f"{where}: the principal point ({matrix_px[0, 2]:.0f}, {matrix_px[1, 2]:.0f}) is that of images of about "
            f"{scale * size_px[0]:.0f} x {scale * size_px[1]:.0f} px, but these have {size_px[0]} x {size_px[1]} px; state in "
            "the file which size it was calibrated for (image_width, image_height)"
        )


def found_or_refused(name: str, read: Callable[[], FoundCamera]) -> FoundCamera:
    """Read one of a file's cameras; one that cannot be read is refused when it is chosen, and does not hide the others."""
    try:
        return read()
    except InputError as error:
        return FoundCamera(name, "", (0.0,) * 9, (), None, refused=str(error))


HASH_TAG = f"# {TAG}\n"


@dataclass(frozen=True, slots=True)
class OwnSyntax:
    """How a format is read whose files are neither JSON nor YAML nor OpenCV's XML.

    Attributes:
        recognizes: whether a file's text, or its bytes if it is none, is of this format.
        read: the cameras in it, in file order; raises InputError.
    """

    recognizes: Callable[[str | bytes], bool]
    read: Callable[[str | bytes, str], tuple[FoundCamera, ...]]


@dataclass(frozen=True, slots=True)
class CameraFormat:
    """A format for the intrinsics of a camera.

    Attributes:
        name: as typed after --to.
        suffix: usual for its files.
        write: the file's content for a camera and its name; raises InputError for a camera that the format cannot store.
        ending: the comment that tells whose file it is; "" if the content does.
    """

    name: str
    suffix: str
    write: Callable[[Camera, str], str]
    ending: str = ""


def refuse_skew(camera: Camera, whose: str) -> None:
    """Refuse a camera with skew, for a format whose readers would ignore it.

    Args:
        camera: the camera to be written.
        whose: the start of the message, before "no skew", such as "COLMAP's models have".

    Raises:
        InputError: it has skew.
    """
    if camera.matrix_px[0, 1] != 0.0:
        raise InputError(f"{whose} no skew, but this camera has; export with --to json instead")


def with_camera(imported: ImportedCalibration, camera: FoundCamera | None, *, source: str) -> ImportedCalibration:
    """Return what was read with its camera; without an image size the camera is completed later, by `camera_for`.

    Raises:
        InputError: a parameter is invalid.
    """
    if camera is None:
        return imported
    if camera.size_px is not None:
        return replace(imported, camera=camera.camera(image_size_px=None, source=source))
    model, distortion = camera.lens(source=source)
    return replace(
        imported, matrix_px=np.reshape(camera.matrix_px, (3, 3)), lens_model=model, distortion=np.array(distortion)
    )
