"""A solved calibration with what is stored along with it: frames, check point, vehicle and serials, evidence, provenance."""

from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias, get_args

import msgspec
import numpy as np
from msgspec import Meta
from msgspec.structs import asdict, replace

from calib_core.errors import InputError
from calib_core.results import Calibration, CheckPoint, InputFile, UnconfirmedClicks
from calib_core.words.verdict import StatedVerdict

MOST_CHARACTERS = 120
"""The longest name or serial, in manifests, files and flags alike."""


Label = Annotated[str, Meta(extra_json_schema={"minLength": 1, "maxLength": MOST_CHARACTERS})]
"""A vehicle, type, session or serial. For the schema only: VehicleNote refuses what is none, and says what to do."""


class VehicleNote(msgspec.Struct, frozen=True, omit_defaults=True):
    """Which vehicle the calibration is of, the serials of its sensors, and where its radar is.

    Attributes:
        name: of the vehicle.
        type: vehicles of one type are mounted alike.
        session: name of the session, such as a date.
        radar_serial: of the radar.
        camera_serial: of the camera.
        frame: the vehicle's frame, in which the returns were recorded before they were taken back to the radar.
        radar_mount: pose of the radar in it that this rests on: x, y, z [m], roll, pitch, yaw [deg] as of a URDF's origin.

    Raises:
        InputError: a text is empty, too long or not printable, or a name has a slash; the message begins with the key.
    """

    name: Label | None = None
    type: Label | None = None
    session: Label | None = None
    radar_serial: Label | None = None
    camera_serial: Label | None = None
    frame: Label | None = None
    radar_mount: tuple[float, float, float, float, float, float] | None = None

    def __post_init__(self) -> None:
        for key, text in asdict(self).items():
            if isinstance(text, str):
                (require_name if key in ("name", "session") else require_label)(text, f"vehicle.{key}")

    def over(self, other: "VehicleNote") -> "VehicleNote":
        """Return another note with what this one states instead."""
        return replace(other, **{key: text for key, text in asdict(self).items() if text is not None})


def require_name(name: str, where: str) -> None:
    """Refuse what cannot name a vehicle or a session, since `VEHICLE/SESSION` names one session.

    Args:
        name: of a vehicle or a session.
        where: the name of the key or flag, with its file, for the message.

    Raises:
        InputError: it is blank, only dots, or too long, or has a slash or an unprintable character.
    """
    require_label(name, where)
    if not name.strip(". ") or set(name) & set("/\\"):
        raise InputError(f"{where}: {name!r} cannot be a name; give one without slashes")


def require_label(text: str, where: str) -> None:
    """Refuse what cannot be a vehicle's type or a sensor's serial.

    Args:
        text: as it was stated.
        where: the name of the key or flag, with its file, for the message.

    Raises:
        InputError: it is blank, too long or not printable.
    """
    if text != text.strip() and text.strip():
        raise InputError(f"{where} is {text!r}; leave out the spaces around it")
    if not text.strip() or not text.isprintable() or len(text) > MOST_CHARACTERS:
        shown = text if len(text) <= MOST_CHARACTERS else f"{text[:20]}…"
        raise InputError(
            f"{where} is {shown!r}; give 1 to {MOST_CHARACTERS} printable characters that are not all spaces"
        )


Evidence: TypeAlias = Literal["clicked", "imported_proven", "imported_assumed", "automatic", "carried"]
"""Solved from clicks; read from another tool's file whose meaning a check point, pairs or another calibration proved; read from
one whose meaning was assumed; solved from clicks of which some or all were placed automatically, and nobody confirmed them;
carried forward from an older calibration by a turn that was watched.
Reading a file never raises the level it states."""

EVIDENCE_LEVELS: tuple[Evidence, ...] = get_args(Evidence)
"""All of them; files that hold only numbers state the position in this list, so new ones go to the end."""
_UNKNOWN: Evidence = "imported_assumed"


def stated_evidence(text: str) -> Evidence:
    """Return the level that a file states; the weakest if it is none of ours, such as one of a later version."""
    return next((level for level in EVIDENCE_LEVELS if level == text), _UNKNOWN)


_Angle = Annotated[float, Meta(ge=-4.0, le=4.0)]
_Angles = tuple[_Angle, _Angle, _Angle]


class CarriedFrom(msgspec.Struct, frozen=True):
    """The calibration that a pose was carried forward from, and by what turn.

    Attributes:
        sha256: of the older calibration's file.
        turn_rad: (3,) of the camera against the radar since: camera_from_radar = Exp(turn) times the older one.
        covariance_rad2: (3, 3) of that turn.
    """

    sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    turn_rad: _Angles
    covariance_rad2: tuple[_Angles, _Angles, _Angles]


EQUATION = "p_camera = R p_radar + t"
_OPTICAL_ENDINGS = ("_optical_frame", "_optical_link", "_optical")
_FALLBACK_RANGE_M = 10.0


@dataclass(frozen=True, slots=True)
class FrameNames:
    """The names of the two frames. A leading "/" is dropped, as tf2 requires.

    Names come from recordings and are written to launch files, where "$" would start a substitution; it is refused.

    Attributes:
        radar: x forward, y left, z up.
        camera: the optical frame: x right, y down, z forward.
    """

    radar: str = "radar"
    camera: str = "camera_optical"

    def __post_init__(self) -> None:
        for role in ("radar", "camera"):
            object.__setattr__(self, role, _checked_name(getattr(self, role), role))
        if self.radar == self.camera:
            raise InputError(f"both frames are called {self.radar!r}; give them different names")

    @property
    def camera_link(self) -> str:
        """The camera's body frame (x forward, y left, z up), parent of the optical frame in URDF and Autoware."""
        stem = self.camera
        for ending in _OPTICAL_ENDINGS:
            stem = stem.removesuffix(ending)
        link = f"{stem}_link" if stem != self.camera else f"{stem.removesuffix('_link')}_body_link"
        return link if link != self.radar else f"{link}_body"


def _checked_name(name: str, role: str) -> str:
    shown = name.strip().lstrip("/")
    if not shown:
        raise InputError(f"the {role} frame has no name; give it one, for example {role!r}")
    if not shown.isprintable() or any(character in shown for character in "$`\\\"'<>&"):
        raise InputError(
            f"the {role} frame is called {name!r}; use a name without control characters, quotes or any of $ ` \\ < > &"
        )
    if {".", ".."} & set(shown.split("/")):
        raise InputError(
            f"the {role} frame is called {name!r}, which is a path; use a name without . and .. between slashes"
        )
    if len(shown) > 200:
        raise InputError(f"the {role} frame's name has {len(shown)} characters; use at most 200")
    return shown


@dataclass(frozen=True, slots=True)
class AssumptionNote:
    """A unit, sign, order or meaning that the files do not state.

    Attributes:
        text: what is assumed, with its topic.
        confirmed: whether the user has confirmed it.
    """

    text: str
    confirmed: bool = False


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a calibration comes from; None where not applicable.

    Attributes:
        inputs: the files it was made from.
        radar_topic: the topic of the radar returns; of several the one with the most.
        radar_topics: all of them.
        radar_choice: which radar was used and why, if there was a choice or it has several topics; else "".
        image_topic: the topic of the images.
        camera_info_topic: the topic of the intrinsics.
        radar_clock: which stamps the radar scans use: "header" or "receive".
        image_clock: the same for the frames.
        radar_axes: the radar's axes and units as the user gave them, in the syntax of --radar-axes.
        video_start: when a video's first frame was taken, in the syntax of --video-start.
        version: the version of this program.
        column_map: which columns of the radar the user gave, each in the syntax of --map.
        assumptions: what the files do not state and reading them takes for granted.
        damage: what of the recording is damaged or missing.
        unconfirmed: the clicks that were placed automatically and that nobody confirmed; None if there are none.
    """

    inputs: tuple[InputFile, ...] = ()
    radar_topic: str | None = None
    image_topic: str | None = None
    camera_info_topic: str | None = None
    radar_clock: str | None = None
    image_clock: str | None = None
    radar_axes: str | None = None
    video_start: str | None = None
    version: str | None = None
    radar_topics: tuple[str, ...] = ()
    radar_choice: str = ""
    column_map: tuple[str, ...] = ()
    assumptions: tuple[AssumptionNote, ...] = ()
    unconfirmed: UnconfirmedClicks | None = None
    damage: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class KeptResult:
    """A result that goes back into the file as it was read: one unknown to this version, or one that follows from others.

    Attributes:
        place: the path to it: keys and list indices, its own key last.
        json_text: its value as JSON.
    """

    place: tuple[str | int, ...]
    json_text: str


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationFile:
    """The content of a calibration-1 file.

    Attributes:
        calibration: the pose, its covariance and the results for each pair.
        frames: the names of the two frames.
        check_point: a radar point and the pixel it must project to; None if a file from another tool has none.
        provenance: where it comes from.
        kept: what stays as it was read when the file is rewritten: results unknown to this version, and those that follow from
            others, which another processor would round differently.
        verdict: how far to trust it, as it was judged when it was solved; None in files of other tools.
        evidence: what the pose rests on, as the file states it; None if it states nothing.
        vehicle: what is stated of the vehicle and its sensors.
        carried_from: the older calibration, if this one was carried forward; None if it was not.
        corrected: the calibration that this one was made from, if its pose is for radar data as reported, without corrections.
        aed_either_way_px: what `raw_data.aed_either_way` found through the lens, of a file for rectified images; else None.
        made_from_sha256: the SHA-256 of the calibration-1 file that this was made from, if something was changed on the way to
            another format, such as the camera of rectified images; "" if nothing was.
    """

    calibration: Calibration
    frames: FrameNames = field(default_factory=FrameNames)
    check_point: CheckPoint | None = None
    provenance: Provenance = field(default_factory=Provenance)
    kept: tuple[KeptResult, ...] = ()
    verdict: StatedVerdict | None = None
    evidence: Evidence | None = None
    made_from_sha256: str = ""
    vehicle: VehicleNote = field(default_factory=VehicleNote)
    carried_from: CarriedFrom | None = None
    corrected: Calibration | None = None
    aed_either_way_px: tuple[float, float] | None = None

    @property
    def is_contradictory(self) -> bool:
        """Whether the data contradicted the pose or each other when it was solved: nobody should use it unawares."""
        return self.verdict is not None and self.verdict.level == "contradictory"

    @property
    def rests_on(self) -> Evidence:
        """What the pose rests on: as stated; else it was clicked if it has solved pairs, and assumed if it has none."""
        return self.evidence or ("clicked" if self.calibration.pairs else "imported_assumed")

    def __str__(self) -> str:
        made_from = ", ".join(part.name for part in self.provenance.inputs)
        own = [
            f"  frames          camera {self.frames.camera!r} from radar {self.frames.radar!r}",
            f"  rests on        {self.rests_on}{f', {made_from}' if made_from else ''}",
            *([f"  written by      cocalib {self.provenance.version}"] if self.provenance.version else []),
        ]
        return "\n".join((str(self.calibration), *own))


def choose_check_point(calibration: Calibration) -> CheckPoint | None:
    """Choose the inlier's true position, rounded to a millimeter, that projects nearest to the image center.

    The plain transform applies to it, because the radar's errors are taken out. If no inlier is in the image, use a point ten
    meters along a ray off the center. None if the lens images neither.
    """
    camera = calibration.camera
    centre_px = np.array([camera.width_px - 1, camera.height_px - 1]) / 2
    inliers = sorted((pair for pair in calibration.pairs if pair.inlier), key=lambda pair: pair.id)
    reported_radar_m = np.array([pair.point_radar_m for pair in inliers]).reshape(-1, 3)
    points_radar_m = np.round(calibration.radar_errors.corrected(reported_radar_m), 3)
    if not _indices_seen(calibration, points_radar_m).size:
        ray = camera.rays(centre_px[None] * (0.9, 1.15))
        points_radar_m = np.round(calibration.camera_from_radar.inverse() @ (ray * _FALLBACK_RANGE_M), 3)
    seen = _indices_seen(calibration, points_radar_m)
    if not seen.size:
        return None
    points_radar_m = points_radar_m[seen]
    pixels_px = calibration.camera.project(calibration.camera_from_radar @ points_radar_m)
    nearest = int(np.argmin(np.linalg.norm(pixels_px - centre_px, axis=1)))
    return CheckPoint(points_radar_m[nearest], pixels_px[nearest])


def _indices_seen(calibration: Calibration, points_radar_m: np.ndarray) -> np.ndarray:
    """Return the indices of the points that the lens images; none if a point is not finite."""
    if not len(points_radar_m) or not np.isfinite(points_radar_m).all():
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(calibration.camera.sees(calibration.camera_from_radar @ points_radar_m))
