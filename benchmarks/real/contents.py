"""What a converter makes of the files of a public set."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import ReflectorClick

__all__ = ["Contents"]


@dataclass(frozen=True, slots=True, eq=False)
class Contents:
    """Pairs, or a recording with clicks or boxes.

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
