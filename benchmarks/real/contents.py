"""A public set as it lies on disk, and what a converter makes of it."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.measurements import ReflectorClick
from calib_core.options import NoiseOptions

__all__ = ["Contents", "RealSet"]


@dataclass(frozen=True, slots=True, eq=False)
class Contents:
    """What is measured: pairs, or a recording with clicks or boxes.

    Attributes:
        camera: the intrinsics that the authors state; None if the recording holds them.
        published: the extrinsics that they state; None if there are none.
        points_radar_m: (n, 3) positions of pairs.
        pixels_px: (n, 2) where the camera saw them.
        recording: what `open_recording` reads.
        clicks: on reflectors in it.
        boxes: what `read_boxes` reads.
    """

    camera: Camera | None
    published: RigidTransform | None = None
    points_radar_m: Points3 = field(default_factory=lambda: np.zeros((0, 3)))
    pixels_px: Points2 = field(default_factory=lambda: np.zeros((0, 2)))
    recording: Path | None = None
    clicks: tuple[ReflectorClick, ...] = ()
    boxes: Path | None = None


@dataclass(frozen=True, slots=True)
class RealSet:
    """One row of the benchmark.

    Attributes:
        name: for --only.
        what: what was measured, in a few words.
        repository: owner/name on GitHub; its checkout is the folder `name`.
        commit: that the checksum is of.
        licence: as the repository states it.
        files: patterns of the files that are read, in the checkout.
        sha256: of them, by `digest`.
        read: makes the contents from the checkout; the second folder is empty, for what it writes.
        bias: what is wrong with the reference, or missing in the set.
        noise: given to the solver.
    """

    name: str
    what: str
    repository: str
    commit: str
    licence: str
    files: tuple[str, ...]
    sha256: str
    read: Callable[[Path, Path], Contents]
    bias: str
    noise: NoiseOptions = field(default_factory=NoiseOptions)

    @property
    def clone(self) -> str:
        """The command that brings the checkout."""
        folder = self.repository.partition("/")[2]
        return f"git clone https://github.com/{self.repository} && git -C {folder} checkout {self.commit}"

    def checkout(self, data: Path) -> Path:
        """Return the folder of the checkout, its files compared with the checksum.

        Raises:
            InputError: it is not there, or its files are others.
        """
        folder = data / self.repository.partition("/")[2]
        if not folder.is_dir():
            raise InputError(f"not there: {self.clone}")
        if (digest := self.digest(folder)) != self.sha256:
            raise InputError(f"other files, sha256 {digest[:12]} instead of {self.sha256[:12]}: {self.clone}")
        return folder

    def digest(self, folder: Path) -> str:
        """Return the sha256 over the names and contents of the files that are read."""
        whole = hashlib.sha256()
        for path in sorted({path for pattern in self.files for path in folder.glob(pattern) if path.is_file()}):
            content = hashlib.sha256(path.read_bytes()).hexdigest()
            whole.update(f"{content}  {path.relative_to(folder).as_posix()}\n".encode())
        return whole.hexdigest()
