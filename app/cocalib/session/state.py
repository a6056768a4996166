"""The session as a value: its intrinsics, what it must know about the recording."""

from dataclasses import dataclass, field
from typing import Annotated, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta

from calib_core.arrays import Indices, TimesNs, freeze
from calib_core.camera import Camera, CameraCovariance
from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, PairResult

_Row: TypeAlias = Annotated[tuple[float, ...], Meta(max_length=40)]
_Row3: TypeAlias = tuple[float, float, float]
_Name: TypeAlias = Annotated[str, Meta(max_length=100)]
_Pixels: TypeAlias = Annotated[int, Meta(ge=1, le=1_000_000)]


class ChosenIntrinsics(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A camera, and where it comes from.

    Attributes:
        about: where it comes from, such as "the board in this recording, 24 views".
        model: name of its lens model.
        size_px: width and height of its images.
        matrix_px: K, row by row [px].
        distortion: coefficients in the lens model's order.
        order: names of the parameters that `covariance` is about; none if nobody said how well they are known.
        covariance: of these, row by row.
    """

    about: Annotated[str, Meta(max_length=500)]
    model: _Name
    size_px: tuple[_Pixels, _Pixels]
    matrix_px: tuple[_Row3, _Row3, _Row3]
    distortion: _Row = ()
    order: Annotated[tuple[_Name, ...], Meta(max_length=40)] = ()
    covariance: Annotated[tuple[_Row, ...], Meta(max_length=40)] = ()

    @classmethod
    def of(cls, camera: Camera, about: str) -> "ChosenIntrinsics":
        """Take a camera's numbers."""
        known = camera.covariance
        first, second, third = ((row[0], row[1], row[2]) for row in camera.matrix_px.tolist())
        return cls(
            about,
            camera.model,
            (camera.width_px, camera.height_px),
            (first, second, third),
            tuple(camera.distortion.tolist()),
            () if known is None else known.order,
            () if known is None else tuple(map(tuple, known.matrix.tolist())),
        )

    @property
    def camera(self) -> Camera:
        """The camera.

        Raises:
            ValueError: the numbers are not a camera's.
        """
        known = CameraCovariance(self.order, np.array(self.covariance)) if self.order else None
        return Camera(self.model, *self.size_px, np.array(self.matrix_px), np.array(self.distortion), known)


Outcome: TypeAlias = Calibration | Unsolvable


@dataclass(frozen=True, slots=True)
class AssumedReading:
    """Something that the recording does not state and reading it takes for granted.

    Attributes:
        text: what is assumed and about which topic; it identifies the assumption.
        hint: what to do if it is right, and if it is not.
    """

    text: str
    hint: str


@dataclass(frozen=True, slots=True, eq=False)
class RecordingFacts:
    """What clicks are checked against.

    Attributes:
        name: what the user calls the recording.
        image_times: (m,) stamps of the frames [ns], ascending and unique.
        width_px: columns of a frame.
        height_px: rows of a frame.
        radar_axes: what the user specified about the radar's axes and units; None if nothing.
        radar_times: (k,) stamps of the radar's scans [ns], ascending; they identify a recording without frames.
        radar_topics: all topics of the radar.
        assumptions: what its files do not state and the user has not confirmed on opening it.
    """

    name: str
    image_times: TimesNs
    width_px: int
    height_px: int
    radar_axes: str | None = None
    radar_times: TimesNs = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    radar_topics: tuple[str, ...] = ()
    assumptions: tuple[AssumedReading, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, np.int64, image_times=(None,), radar_times=(None,))

    @property
    def has_images(self) -> bool:
        """Whether there are frames to click in."""
        return len(self.image_times) > 0

    @property
    def moments(self) -> TimesNs:
        """The stamps (m,) that can be looked at [ns]: of the frames, or of the radar scans if there are no frames."""
        return self.image_times if self.has_images else self.radar_times

    def unconfirmed(self, session: "Session") -> tuple[AssumedReading, ...]:
        """Return the assumptions that the user has not confirmed."""
        return tuple(assumption for assumption in self.assumptions if assumption.text not in session.confirmed)

    def frame_at(self, time: TimeNs) -> int | None:
        """Return the index of the frame with exactly this stamp; None when no frame has it."""
        index = int(np.searchsorted(self.image_times, time))
        return index if index < len(self.image_times) and int(self.image_times[index]) == time else None

    def frames_at(self, times_ns: TimesNs) -> Indices:
        """Return the index of the frame with each stamp (n,) [ns]; -1 when no frame has it."""
        places = np.searchsorted(self.image_times, times_ns)
        found = np.append(self.image_times, np.iinfo(np.int64).min)[places] == times_ns
        return np.where(found, places, -1)

    def has_pixel(self, u_px: float, v_px: float) -> bool:
        """Return whether a pixel is on the frame, whose edge is half a pixel outside the outermost pixel centres."""
        return -0.5 <= u_px <= self.width_px - 0.5 and -0.5 <= v_px <= self.height_px - 0.5


@dataclass(frozen=True, slots=True)
class DismissedPlacement:
    """A placement that the user dismissed.

    Attributes:
        time: a stamp within it.
        position_m: (x, y, z) of it in the radar frame.
    """

    time: TimeNs
    position_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Session:
    """Everything the user decided, and the resulting outcome.

    Attributes:
        clicks: sorted by time, then id.
        options: what the next solve uses.
        next_click: number of the next id ("c7"); it only increases, so that no id is used twice.
        revision: increases by one with every change of clicks or options, including undo and redo.
        outcome: the latest answer; it stays while a newer one is being computed.
        outcome_revision: the revision that `outcome` answers; -1 before the first.
        checked: while there is no calibration, the clicks evaluated under the one given for review.
        column_map: the values of --map that the recording is read with; remembered for the next opening.
        confirmed: texts of the assumptions about the recording that the user has confirmed.
        dismissed: placements that are not the reflector.
        reviewed: ids of the clicks that a person has looked at and left as they are.
        acknowledged: codes of the warnings that the user has read.
        intrinsics: chosen for this session; None to use those that it was opened with.
    """

    clicks: tuple[ReflectorClick, ...] = ()
    options: CalibrationOptions = field(default_factory=CalibrationOptions)
    next_click: int = 1
    revision: int = 0
    outcome: Outcome | None = None
    outcome_revision: int = -1
    checked: tuple[PairResult, ...] = ()
    column_map: tuple[str, ...] = ()
    confirmed: tuple[str, ...] = ()
    dismissed: tuple[DismissedPlacement, ...] = ()
    reviewed: tuple[str, ...] = ()
    acknowledged: tuple[str, ...] = ()
    intrinsics: ChosenIntrinsics | None = None

    @property
    def is_solved(self) -> bool:
        """Whether the outcome answers the current clicks and options, and has been checked."""
        return self.outcome is not None and self.outcome_revision == self.revision and not self.is_checking

    @property
    def is_checking(self) -> bool:
        """Whether the outcome is a preview of the answer to the current clicks and options."""
        preview = isinstance(self.outcome, Calibration) and self.outcome.checking
        return preview and self.outcome_revision == self.revision

    @property
    def needs_solving(self) -> bool:
        """Whether there is something to solve that has not been answered."""
        return bool(self.clicks) and not self.is_solved
