"""What a person can do about a calibration, as a closed set of small types; `calib_core.words` says them, the page draws them."""

from dataclasses import dataclass
from typing import TypeAlias

from calib_core.json_forms import Position


@dataclass(frozen=True, slots=True)
class ClickMore:
    """Click placements that have no click yet.

    Attributes:
        count: how many are left; None if that is not known.
        or_export: the calibration is good enough to be exported already.
    """

    count: int | None = None
    or_export: bool = False


@dataclass(frozen=True, slots=True)
class ClickFirst:
    """Click the reflector for the first time.

    Attributes:
        placements_known: the recording's placements have been found.
    """

    placements_known: bool = False


@dataclass(frozen=True, slots=True)
class PlaceReflector:
    """Set the reflector down at one more place.

    Attributes:
        position_radar_m: where.
        gain: present over expected uncertainty (standard deviations), above 1.
    """

    position_radar_m: Position
    gain: float


@dataclass(frozen=True, slots=True)
class ReviewPairs:
    """Look at pairs, and correct or exclude them.

    Attributes:
        ids: of the pairs.
    """

    ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ChooseReturn:
    """Say which radar return belongs to a pair.

    Attributes:
        ids: of the pairs.
    """

    ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class MeasureCameraPosition:
    """Measure where the camera is from the radar, and enter it as solving.camera_position."""


@dataclass(frozen=True, slots=True)
class SpreadPlacements:
    """Add placements where there are none: at both edges of the image, or at several heights."""

    at: str


@dataclass(frozen=True, slots=True)
class SetOption:
    """Set an option, or look at it.

    Attributes:
        name: its path, such as "gating.max_range_m", or of what says how a recording is read, such as "radar_axes".
        value: that it is to have; "" if the person chooses it.
    """

    name: str
    value: str = ""


@dataclass(frozen=True, slots=True)
class CalibrateLens:
    """Calibrate the lens, or give intrinsics that belong to it."""


@dataclass(frozen=True, slots=True)
class ReduceError:
    """Learn more of a systematic error.

    Attributes:
        name: of the error.
        measured: the camera position is measured already.
    """

    name: str
    measured: bool


@dataclass(frozen=True, slots=True)
class ConfirmAssumptions:
    """Confirm what is assumed about the recording."""


@dataclass(frozen=True, slots=True)
class FollowHint:
    """Do what the verdict's cause advises."""


@dataclass(frozen=True, slots=True)
class Export:
    """Nothing more is needed."""


@dataclass(frozen=True, slots=True)
class Stop:
    """No further placement would help noticeably."""


Action: TypeAlias = (
    ClickMore
    | ClickFirst
    | PlaceReflector
    | ReviewPairs
    | ChooseReturn
    | MeasureCameraPosition
    | SpreadPlacements
    | SetOption
    | CalibrateLens
    | ReduceError
    | ConfirmAssumptions
    | FollowHint
    | Export
    | Stop
)
