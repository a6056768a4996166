"""Read the messages of drivers that send one return per message, and find where each scan begins."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.recordings.messages.decoding import Message, Pin, decode, fixed_part
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.radar.column_guess import plan_described
from calib_core.recordings.radar.column_plan import NOTHING_STATED, ColumnPlan, StatedReading
from calib_core.recordings.radar.columns import Returns, returns_from
from calib_core.recordings.radar.message_layouts.samples import Samples, described
from calib_core.recordings.radar.registry import find_decoder

_FRAME_NUMBERS = ("radar_frame_idx", "frame_idx", "frame_number", "frame_id_number", "frame_counter")
POINT_NUMBERS = ("point_id", "detection_id", "target_id", "index")
"""Fields that number the returns of a scan."""
SHORTEST_CYCLE_NS = 5e6
"""No radar measures more often [ns]."""
_SAMPLED_RETURNS = 60


@dataclass(frozen=True, slots=True, eq=False)
class PointLayout:
    """Reads drivers that publish every return as a separate message (ti_mmwave_rospkg and its forks).

    Attributes:
        frame_number: the field that numbers scans, or None.
        point_number: the field that numbers returns within a scan, or None.
        pins: offsets of the lengths of all strings before the last number, and their values in the first message.
    """

    definition: Definition
    plan: ColumnPlan
    dtype: np.dtype[Any]
    frame_number: str | None
    point_number: str | None
    pins: tuple[Pin, ...]

    one_per_message = True
    lidar_like = False

    @classmethod
    def recognise(
        cls, definition: Definition, samples: Samples, stated: StatedReading = NOTHING_STATED
    ) -> "PointLayout | None":
        """Recognize a radar return by its fields of fixed size: a position and a speed."""
        dtype, pins = fixed_part(definition, samples.payload)
        names = [name for name in dtype.names or () if not dtype[name].shape]
        strings = [field.name for field in definition.fields if field.type == "string"]
        within = stated.within("", names)
        if within is None:
            return None
        decoder = find_decoder("point", (*names, *strings))
        plan = _point_plan(definition, samples, names, strings, within)
        if plan is None:
            return None
        numbers = (decoder.point_number,) if decoder and decoder.point_number else POINT_NUMBERS
        return cls(
            definition,
            plan,
            dtype,
            next((name for name in _FRAME_NUMBERS if name in names), None),
            next((name for name in numbers if name in names), None),
            pins,
        )

    @property
    def description(self) -> str:
        """Describe what is read."""
        how = self.frame_number or self.point_number or "pauses"
        return f"one return per message, scans separated by {how}: {self.plan.describe()}"

    def returns_of_rows(self, rows: np.ndarray) -> Returns:
        """Read many returns from the first bytes of their messages, (n, dtype.itemsize)."""
        points = self.view(rows)
        return _known_snr(returns_from(self.plan, lambda name: points[name]))

    def returns(self, payload: bytes) -> Returns:
        """Read the return in one whole message with strings of any length.

        Raises:
            MessageError: the bytes do not fit the definition.
        """
        message = self.message(payload)
        return _known_snr(returns_from(self.plan, lambda name: np.array([message.number(name)])))

    def message(self, payload: bytes) -> Message:
        """Decode one whole message.

        Raises:
            MessageError: the bytes do not fit the definition.
        """
        return decode(self.definition, payload)

    def misfits(self, rows: np.ndarray) -> np.ndarray:
        """Return which rows have string lengths other than the first message's, and therefore other field offsets."""
        moved = np.zeros(len(rows), dtype=bool)
        for pin in (pin for pin in self.pins if pin.offset + 4 <= rows.shape[1]):
            moved |= (rows[:, pin.offset : pin.offset + 4] != np.frombuffer(pin.length, dtype=np.uint8)).any(axis=1)
        return moved

    def view(self, rows: np.ndarray) -> np.ndarray:
        """View raw rows (n, dtype.itemsize) as records."""
        return np.ascontiguousarray(rows).view(self.dtype)[:, 0]

    @property
    def group_bytes(self) -> int:
        """How many leading bytes of a message contain the stamp and the numbers that separate scans."""
        places = [self._place(name) for name in (self.frame_number, self.point_number) if name]
        return max([12, *(offset + code.itemsize for code, offset in places)])

    def numbers(self, rows: np.ndarray) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Read frame and point numbers from rows of at least group_bytes: (n,) each, None for a missing one."""
        frame = self._column(rows, self.frame_number).copy() if self.frame_number else None
        return frame, self._column(rows, self.point_number).copy() if self.point_number else None

    def _column(self, rows: np.ndarray, name: str) -> np.ndarray:
        code, offset = self._place(name)
        return np.ascontiguousarray(rows[:, offset : offset + code.itemsize]).view(code)[:, 0]

    def _place(self, name: str) -> tuple[np.dtype[Any], int]:
        assert self.dtype.fields is not None
        place = self.dtype.fields[name]
        return place[0], place[1]


def _point_plan(
    definition: Definition, samples: Samples, names: Sequence[str], strings: Sequence[str], stated: StatedReading
) -> ColumnPlan | None:
    """Plan the columns of single returns; those of other sensors' messages, such as a vehicle's pose, are not planned."""
    columns = described(definition, definition.type, names)
    first = None if stated.column_map else plan_described("point", columns, strings, stated=stated)
    if first is not None and first.decoder:
        return first
    nested = first is not None and not first.polar and any("." in name for name in first.position)
    if not stated.column_map and (first is None or first.doppler is None or nested):
        return None
    messages = samples.decoded(_SAMPLED_RETURNS)
    columns = described(
        definition, definition.type, names, lambda name: np.array([message.number(name) for message in messages])
    )
    return plan_described("point", columns, strings, definition.remarks.get(definition.type, ""), stated)


def _known_snr(returns: Returns) -> Returns:
    """Replace zero intensities by NaN: the stock driver never fills them in."""
    if returns.snr_db.flags.writeable:
        returns.snr_db[returns.snr_db == 0.0] = np.nan
    return returns


def first_of_scans(
    times_ns: TimesNs, frame_numbers: np.ndarray | None = None, point_numbers: np.ndarray | None = None
) -> np.ndarray:
    """Find the message that begins each scan, for drivers that send one message per return.

    A scan ends where the frame number changes; without one, where the point number does not rise; and in any case at a
    pause longer than half the usual time between scans (the numbers cannot separate scans of a single return).

    Args:
        times_ns: (n,) stamps in the order of the recording.
        frame_numbers: (n,) or None.
        point_numbers: (n,) or None.

    Returns:
        (m,) indices, ascending, the first is 0; empty if n is 0.
    """
    n = len(times_ns)
    if n < 2:
        return np.zeros(n, dtype=np.int64)
    pauses_ns = np.diff(times_ns)
    if frame_numbers is not None:
        begins = np.diff(frame_numbers.astype(np.int64)) != 0
        return np.concatenate([[0], np.flatnonzero(begins) + 1])
    if point_numbers is not None:
        begins = np.diff(point_numbers.astype(np.int64)) <= 0
        usual_ns = float(np.median(np.diff(times_ns[np.flatnonzero(begins) + 1]))) if begins.sum() > 2 else np.inf
    else:
        begins = np.zeros(n - 1, dtype=bool)
        usual_ns = 2.0 * _between_scans_ns(pauses_ns)
    if usual_ns > 0:
        begins = begins | (pauses_ns > 0.5 * usual_ns)
    return np.concatenate([[0], np.flatnonzero(begins) + 1])


def _between_scans_ns(pauses_ns: np.ndarray) -> float:
    """Return a threshold between the pauses within a scan and those between scans.

    It is the middle of the widest gap between their logarithms. If all pauses are alike, it is half of the shortest one, but
    at least 5 ms: no radar cycle is shorter, and no driver takes that long from one return to the next.
    """
    positive = np.sort(pauses_ns[pauses_ns > 0]).astype(np.float64)
    if not len(positive):
        return np.inf
    logs = np.log(positive)
    if np.any(pauses_ns <= 0):
        logs = np.concatenate([[logs[0] - 1.0], logs])
    steps = np.diff(logs)
    if not len(steps) or steps.max() < np.log(2.0):
        return max(float(positive[0]) / 2, SHORTEST_CYCLE_NS)
    cut = int(np.argmax(steps))
    return float(np.exp((logs[cut] + logs[cut + 1]) / 2))
