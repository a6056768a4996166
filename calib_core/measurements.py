"""Measurements: radar scans, clicks, the pairs made from them, and boxes around objects in camera frames."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Annotated, Any, Literal, NoReturn, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta

from calib_core.arrays import Indices, Matrix33, Points3, TimesNs, Values, Vector2, Vector3, freeze, frozen_array
from calib_core.errors import UnsolvableError, in_words
from calib_core.json_forms import Name, Position

NS_PER_S = 1_000_000_000

MIN_PAIRS = 4
"""The fewest pairs that determine a pose: three leave up to four solutions, the fourth selects one."""


class Stamp(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stamp as in ROS 2: whole seconds since the epoch, and nanoseconds within the second."""

    sec: Annotated[int, Meta(ge=0, le=9_223_372_035)]
    nanosec: Annotated[int, Meta(ge=0, le=999_999_999)]

    @classmethod
    def of(cls, time: "TimeNs") -> "Stamp":
        """Split a time in nanoseconds."""
        return cls(*time_parts(time))

    @property
    def time(self) -> "TimeNs":
        """The same time in nanoseconds since the epoch."""
        return time_from_parts(self.sec, self.nanosec)


class TimeNs(int):
    """Nanoseconds since the epoch. Never a float: a float64 of the present time is off by up to 128 ns.

    JSON holds two integers, because a JavaScript number cannot hold present times in nanoseconds.
    """

    __slots__ = ()
    json_form = Stamp

    @staticmethod
    def from_json(stamp: Stamp) -> "TimeNs":
        """Return the time of a stamp."""
        return stamp.time


def time_from_parts(sec: int, nanosec: int) -> TimeNs:
    """Make a time from the two integers used by ROS 2 and by our JSON files."""
    return TimeNs(sec * NS_PER_S + nanosec)


def time_parts(time: TimeNs) -> tuple[int, int]:
    """Split a stamp into whole seconds and the nanoseconds within the second."""
    return divmod(int(time), NS_PER_S)


Mark: TypeAlias = Literal["clicked", "moved", "snapped", "untouched"]
"""How a click came to its pixel: set or moved by a person, snapped to the reflector's apex in the image, or left untouched
where the radar expected it; the last is no measurement."""


class ChosenReturn(msgspec.Struct, frozen=True, order=True, omit_defaults=True):
    """The radar return that a person chose for a click, at the position that the radar reports.

    Attributes:
        position_m: (x, y, z) in the radar frame.
        radar_time: stamp of the nearest scan; None if unknown.
        topic: of the radar; "" if unknown.
    """

    position_m: Position
    radar_time: TimeNs | None = None
    topic: str = ""


@dataclass(frozen=True, slots=True, order=True)
class ReflectorClick:
    """The reflector's centre, clicked in one camera frame. Sorts by time, then id.

    Attributes:
        image_time: the recorded stamp of the frame.
        id: unique within a session.
        u_px: column; (0, 0) is the centre of the top-left pixel.
        v_px: row.
        sigma_px: standard deviation of the click per axis; None takes the options' value.
        excluded: kept and shown, but not used to solve.
        mark: how it came to its pixel.
        chosen: the radar return that it belongs to, if a person said so.
    """

    image_time: TimeNs
    id: str
    u_px: float
    v_px: float
    sigma_px: float | None = None
    excluded: bool = False
    mark: Mark = "clicked"
    chosen: ChosenReturn | None = None

    @property
    def counts(self) -> bool:
        """Whether it is used to solve: not excluded, and a measurement rather than a guess."""
        return not self.excluded and self.mark != "untouched"


@dataclass(frozen=True, slots=True, eq=False)
class RadarScan:
    """All returns of one radar measurement cycle.

    Attributes:
        time: the stamp of the scan.
        points_radar_m: (n, 3) positions; x forward, y left, z up. May contain NaN if the message does.
        doppler_mps: (n,) radial velocity, positive moving away; NaN where the message has none.
        snr_db: (n,) signal-to-noise ratio or another amplitude in dB; NaN where the message has none.
        sigma_polar: (n, 3) standard deviations of range [m], azimuth and elevation [rad]; NaN where the message has none.
        alternative_of: (n,) equal numbers are alternative positions of one return, of which at most one is true; -1 for a
            return without alternatives. None if there are none at all.
    """

    time: TimeNs
    points_radar_m: Points3
    doppler_mps: Values
    snr_db: Values
    sigma_polar: Points3
    alternative_of: Indices | None = None

    def __post_init__(self) -> None:
        n = len(self.points_radar_m)
        freeze(self, points_radar_m=(n, 3), doppler_mps=(n,), snr_db=(n,), sigma_polar=(n, 3))
        object.__setattr__(self, "alternative_of", _frozen_alternatives(self.alternative_of, n))

    def __len__(self) -> int:
        return len(self.points_radar_m)


def _frozen_alternatives(alternative_of: Indices | None, n: int) -> Indices | None:
    return None if alternative_of is None else frozen_array(alternative_of, (n,), dtype=np.int64)


RETURN_COLUMNS = ("points_radar_m", "doppler_mps", "snr_db", "sigma_polar")
"""What is known of each return, beside its alternatives."""


def _no_first_return() -> Indices:
    return np.zeros(1, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class RadarScans:
    """Many scans of one radar as columns, as used by pairing and by the timeline.

    Attributes:
        times_ns: (m,) one stamp per scan, ascending.
        first_return: (m + 1,) scan i owns the rows first_return[i] to first_return[i + 1].
        points_radar_m: (n, 3) as in RadarScan, all scans concatenated.
        doppler_mps: (n,).
        snr_db: (n,).
        sigma_polar: (n, 3).
        alternative_of: (n,) as in RadarScan, each scan with numbers of its own; None if no return has alternatives.
    """

    times_ns: TimesNs = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    first_return: Indices = field(default_factory=_no_first_return)
    points_radar_m: Points3 = field(default_factory=lambda: np.zeros((0, 3)))
    doppler_mps: Values = field(default_factory=lambda: np.zeros(0))
    snr_db: Values = field(default_factory=lambda: np.zeros(0))
    sigma_polar: Points3 = field(default_factory=lambda: np.zeros((0, 3)))
    alternative_of: Indices | None = None

    def __post_init__(self) -> None:
        n, m = len(self.points_radar_m), len(self.times_ns)
        freeze(self, points_radar_m=(n, 3), doppler_mps=(n,), snr_db=(n,), sigma_polar=(n, 3))
        freeze(self, np.int64, times_ns=(m,), first_return=(m + 1,))
        object.__setattr__(self, "alternative_of", _frozen_alternatives(self.alternative_of, n))
        if np.any(np.diff(self.times_ns) < 0):
            raise ValueError("scans must be in ascending order of time")
        if self.first_return[0] != 0 or self.first_return[-1] != n or np.any(np.diff(self.first_return) < 0):
            raise ValueError("first_return must rise from 0 to the number of returns")

    def __len__(self) -> int:
        return len(self.times_ns)

    @classmethod
    def from_scans(cls, scans: "list[RadarScan] | tuple[RadarScan, ...]") -> "RadarScans":
        """Stack scans, sorted by time; scans of the same stamp keep their order."""
        if not scans:
            return cls()
        ordered = sorted(scans, key=lambda scan: scan.time)
        return cls(
            times_ns=np.array([scan.time for scan in ordered], dtype=np.int64),
            first_return=np.concatenate([[0], np.cumsum([len(scan) for scan in ordered])]),
            **_joined_columns(ordered),
        )

    @classmethod
    def joined(cls, pieces: "Sequence[RadarScans]") -> "RadarScans":
        """Concatenate scans; the pieces must be in order of time."""
        if len(pieces) < 2:
            return pieces[0] if pieces else cls()
        counts = np.concatenate([np.diff(piece.first_return) for piece in pieces])
        return cls(
            times_ns=np.concatenate([piece.times_ns for piece in pieces]),
            first_return=np.concatenate([[0], np.cumsum(counts)]),
            **_joined_columns(pieces),
        )

    def scan(self, index: int) -> RadarScan:
        """Return one scan by its index in time order."""
        rows = slice(int(self.first_return[index]), int(self.first_return[index + 1]))
        return RadarScan(time=TimeNs(int(self.times_ns[index])), **self._columns(rows))

    def nearest(self, time: TimeNs) -> int:
        """Find the scan with the nearest stamp; of two equally near, the earlier one.

        Raises:
            ValueError: there are no scans.
        """
        if not len(self):
            raise ValueError("no scans to choose from")
        after = int(np.searchsorted(self.times_ns, time))
        before = max(after - 1, 0)
        after = min(after, len(self) - 1)
        return before if time - int(self.times_ns[before]) <= int(self.times_ns[after]) - time else after

    def between(self, start: TimeNs, end: TimeNs) -> "RadarScans":
        """Keep the scans with start <= stamp <= end."""
        first = int(np.searchsorted(self.times_ns, start, side="left"))
        return self.part(first, max(int(np.searchsorted(self.times_ns, end, side="right")), first))

    def part(self, first: int, last: int) -> "RadarScans":
        """Keep the scans first to last - 1."""
        if first == 0 and last == len(self):
            return self
        low, high = int(self.first_return[first]), int(self.first_return[last])
        return self.with_rows(slice(low, high), self.times_ns[first:last], self.first_return[first : last + 1] - low)

    def take(self, rows: Indices) -> "RadarScans":
        """Keep the returns of the given rows, ascending; every scan is kept, even if it becomes empty."""
        return self.with_rows(rows, self.times_ns, np.searchsorted(rows, self.first_return))

    def with_rows(self, rows: Indices | slice, times_ns: TimesNs, first_return: Indices) -> "RadarScans":
        """Return other scans, made of some rows of these.

        Args:
            rows: (n,) of the returns.
            times_ns: (m,) of the scans.
            first_return: (m + 1,) into the rows.
        """
        return RadarScans(times_ns=times_ns, first_return=first_return, **self._columns(rows))

    def _columns(self, rows: Indices | slice) -> dict[str, Any]:
        """Return the columns of some returns."""
        alternatives = None if self.alternative_of is None else self.alternative_of[rows]
        return {name: getattr(self, name)[rows] for name in RETURN_COLUMNS} | {"alternative_of": alternatives}

    def scan_of_return(self) -> Indices:
        """Return, for each row, the index of the scan that owns it: (n,)."""
        return np.repeat(np.arange(len(self), dtype=np.int64), np.diff(self.first_return))


def _joined_columns(pieces: "Sequence[RadarScan | RadarScans]") -> dict[str, Any]:
    """Concatenate the columns of scans; no alternatives if no return has any."""
    joined = {name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in RETURN_COLUMNS}
    given = [(piece.alternative_of, len(piece.points_radar_m)) for piece in pieces]
    if all(own is None for own, _ in given):
        return joined
    alternatives = np.concatenate([np.full(count, -1) if own is None else own for own, count in given])
    return joined | {"alternative_of": alternatives}


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A radar position that may be the reflector at one click.

    Attributes:
        position_radar_m: (3,) mean of its returns.
        sigma_polar: (3,) standard deviations of range [m], azimuth [rad], elevation [rad] of that position, noise floor included.
        covariance_m2: (3, 3) the same in the Cartesian axes of the radar frame.
        score: plausibility before any pose is known, 0 to 1; the scores of one pair sum to at most 1.
        returns: number of returns averaged.
        scans: number of scans they come from.
        snr_db: their mean SNR; NaN if the radar reports none.
        alternative_of: candidates of one pair with equal numbers are alternative positions of one return; -1 has no
            alternative.
    """

    position_radar_m: Vector3
    sigma_polar: Vector3
    covariance_m2: Matrix33
    score: float = 1.0
    returns: int = 1
    scans: int = 1
    snr_db: float = float("nan")
    alternative_of: int = -1

    def __post_init__(self) -> None:
        freeze(self, position_radar_m=(3,), sigma_polar=(3,), covariance_m2=(3, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """One click and the radar positions that may belong to it, the most plausible first.

    Attributes:
        id: the click's id.
        pixel_px: (2,) the click.
        sigma_px: its standard deviation per axis; None takes the options' value.
        candidates: at least one.
        image_time: stamp of the frame; None for pairs from a pairs file.
        radar_time: stamp of the nearest scan; None for pairs from a pairs file.
        mark: how the click came to its pixel.
        chosen: the return that a person chose; the pair then has no other candidate.
        set_aside: the candidates that this choice ruled out.
    """

    id: str
    pixel_px: Vector2
    candidates: tuple[Candidate, ...]
    sigma_px: float | None = None
    image_time: TimeNs | None = None
    radar_time: TimeNs | None = None
    mark: Mark = "clicked"
    chosen: ChosenReturn | None = None
    set_aside: tuple[Candidate, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, pixel_px=(2,))
        for name in ("image_time", "radar_time"):
            if (time := getattr(self, name)) is not None:
                object.__setattr__(self, name, TimeNs(time))
        if not self.candidates:
            raise ValueError(f"pair {self.id} has no radar position")


Facts: TypeAlias = Mapping[str, Any]
"""Numbers with their unit in the name, words of a closed set, ids of pairs, other values. What the facts of a code are is the
signature of its row in `calib_core.words`."""


@dataclass(frozen=True, slots=True)
class _Stated:
    """Something that is known by a code and its facts; `calib_core.words` says it.

    Attributes:
        code: identifier for programs, such as "mirrored-axes"; stable.
        facts: what its sentence is made of; of something that another file or tool said, its "message" and "hint".
    """

    code: str
    facts: Facts = field(default_factory=dict, hash=False)

    def __str__(self) -> str:
        return in_words(self)


@dataclass(frozen=True, slots=True)
class DataWarning(_Stated):
    """Something to know before using the result."""

    @classmethod
    def reported(cls, code: str, message: str, hint: str) -> "DataWarning":
        """Return a warning as somebody else worded it: the reader of a recording, or the file that it stands in."""
        return cls(code, {"message": message, "hint": hint})


@dataclass(frozen=True, slots=True)
class Unpaired(_Stated):
    """A click that found no radar position.

    Attributes:
        id: the click's id.
    """

    _: KW_ONLY
    id: Name

    @classmethod
    def reported(cls, name: str, code: str, reason: str, hint: str) -> "Unpaired":
        """Return a click without a radar position as a file says it."""
        return cls(code, {"message": reason, "hint": hint}, id=name)


@dataclass(frozen=True, slots=True)
class Unsolvable(_Stated):
    """The outcome when the data cannot give a calibration. It is a value, not an error.

    Attributes:
        unpaired: clicks without a radar position; often the cause.
        suspected: what looks wrong with the input, and may be the cause.
        pairs: the others, with their candidates; empty if unknown.
    """

    unpaired: tuple[Unpaired, ...] = ()
    suspected: tuple[DataWarning, ...] = ()
    pairs: tuple[Pair, ...] = field(default=(), compare=False, repr=False)

    @classmethod
    def reported(cls, code: str, reason: str, hint: str, unpaired: tuple[Unpaired, ...] = ()) -> "Unsolvable":
        """Return an outcome as somebody else worded it."""
        return cls(code, {"message": reason, "hint": hint}, unpaired)

    def unwrap(self) -> NoReturn:
        """Raise, because there is no calibration; `Calibration.unwrap` returns itself.

        Raises:
            UnsolvableError: its reason and hint in one line.
        """
        raise UnsolvableError(self.code, self)


@dataclass(frozen=True, slots=True)
class Cuboid:
    """The box in space around an object, upright, in the camera frame.

    Attributes:
        centre_camera_m: x, y, z of its middle.
        length_m: along its heading.
        width_m: across it.
        heading_rad: of its length about the vertical, from straight ahead, positive to the left.
    """

    centre_camera_m: tuple[float, float, float]
    length_m: float
    width_m: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle around one object in one frame; pixel (0, 0) is the centre of the top-left pixel.

    Attributes:
        left_px: of its left edge.
        top_px: of its upper edge.
        right_px: of its right edge, not less than left_px.
        bottom_px: of its lower edge, not less than top_px.
        label: the object's class, such as "person"; "" if the source states none.
        score: the detector's confidence, 0 to 1; 1 for a box drawn by a person.
        track: the same for boxes of one object in several frames; "" if the source does not follow objects.
        cuboid: around the same object; None if the source has none.
    """

    left_px: float
    top_px: float
    right_px: float
    bottom_px: float
    label: str = ""
    score: float = 1.0
    track: str = ""
    cuboid: Cuboid | None = None


@dataclass(frozen=True, slots=True)
class FrameBoxes:
    """The boxes of one annotated frame; none is a statement too: nothing was seen there.

    Attributes:
        image_time: the recorded stamp of the frame.
        boxes: in any order.
    """

    image_time: TimeNs
    boxes: tuple[Box, ...]


@dataclass(frozen=True, slots=True)
class Boxes:
    """The boxes of a recording. A frame that is not listed was not annotated and does not count.

    Attributes:
        frames: in order of time, each stamp once.
        source: where they come from, for messages: a file's name or a topic.
        image_size_px: width and height of the images that they were made on; None if the source states none.
        notes: what reading took for granted, as sentences without their final periods.
    """

    frames: tuple[FrameBoxes, ...]
    source: str
    image_size_px: tuple[int, int] | None = None
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[FrameBoxes]:
        return iter(self.frames)

    @property
    def times_ns(self) -> TimesNs:
        """The stamps of the annotated frames: (n,), ascending."""
        return np.array([frame.image_time for frame in self.frames], dtype=np.int64)

    @property
    def labels(self) -> tuple[str, ...]:
        """The classes that occur, sorted."""
        return tuple(sorted({box.label for frame in self.frames for box in frame.boxes}))


class LabelledScan(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which object each return of a scan comes from, in the scan's order; "" for anything else.

    Attributes:
        radar_time: stamp of the scan.
        tracks: the objects, as in Box.track.
    """

    radar_time: TimeNs
    tracks: tuple[Annotated[str, Meta(max_length=200)], ...]


@dataclass(frozen=True, slots=True)
class ReturnLabels:
    """The true origin of a simulated recording's returns.

    Attributes:
        scans: in order of time.
        source: for messages.
    """

    scans: tuple[LabelledScan, ...]
    source: str
