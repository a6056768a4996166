"""Read radar returns from sensor_msgs/PointCloud2 of any memory layout, and from sensor_msgs/PointCloud with channels."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import as_strided

from calib_core.errors import MessageError
from calib_core.recordings.field_words import names_a_speed
from calib_core.recordings.messages.decoding import Message, decode, payload_byte_order
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.radar.column_guess import DescribedColumn, plan_described, plan_names
from calib_core.recordings.radar.column_plan import NOTHING_STATED, ColumnPlan, StatedReading
from calib_core.recordings.radar.columns import Returns, no_returns, returns_from
from calib_core.recordings.radar.message_layouts.samples import Samples

_CLOUD_NAMES = frozenset({"height", "width", "fields", "is_bigendian", "point_step", "row_step", "data"})


_FORMATS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


_MAX_POINT_STEP = 1 << 16


_LIDAR_POINTS = 5000
"""A cloud of more points is a lidar's."""


def is_cloud(definition: Definition) -> bool:
    """Return whether a message is laid out as sensor_msgs/PointCloud2."""
    return definition.names >= _CLOUD_NAMES


@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """The memory layout of a point, and the plan for reading it."""

    dtype: np.dtype[Any]
    plan: ColumnPlan


@dataclass(frozen=True, slots=True, eq=False)
class CloudLayout:
    """Reads PointCloud2. The field description is parsed once, then recognized by its bytes."""

    definition: Definition
    plan: ColumnPlan
    lidar_like: bool
    _known: dict[bytes, _Shape] = field(default_factory=dict, init=False)

    one_per_message = False

    @classmethod
    def recognise(cls, samples: Samples, stated: StatedReading = NOTHING_STATED) -> "CloudLayout | None":
        """Recognize the layout from a first message; None if it contains no positions."""
        definition, payload = samples.definition, samples.payload
        message = decode(definition, payload)
        dtype = _point_dtype(message, payload_byte_order(payload, definition))
        within = stated.within("", dtype.names or ())
        if within is None:
            return None
        plan = plan_names("cloud", dtype.names or (), within)
        whole = plan is not None and any(dtype[name].kind != "f" for name in plan.position)
        if plan is None or not plan.decoder or whole:  # integers are hardly meters
            plan = plan_described("cloud", _cloud_columns(samples, dtype), stated=within)
        if plan is None:
            return None
        points = message.whole("height") * message.whole("width")
        return cls(definition, plan, lidar_like(plan, dtype.names or (), points))

    @property
    def description(self) -> str:
        """Describe what is read."""
        return self.plan.describe()

    def returns(self, payload: bytes) -> Returns:
        """Read one cloud.

        Raises:
            MessageError: the message is inconsistent.
        """
        row = np.frombuffer(payload, dtype=np.uint8)[None]
        fast = self.returns_of_rows(row, np.array([len(payload)])) if self._known else None
        if fast is not None:
            return fast[0]
        message = decode(self.definition, payload)
        order = payload_byte_order(payload, self.definition)
        data = message.octets("data")
        height, width, step = message.whole("height"), message.whole("width"), message.whole("row_step")
        dtype = _point_dtype(message, order)
        plan = _plan_like(self.plan, dtype.names or ())
        if plan is None:
            raise MessageError(f"a cloud has no position, only the fields {', '.join(dtype.names or ('(none)',))}")
        points = _points(data, dtype, height, width, step)
        dense = np.array([not (self.definition.names & {"is_dense"}) or bool(message.whole("is_dense"))])
        returns = _unless_marked(_returns(points, plan), dense, np.array([len(points)]))
        beyond = _points_beyond_width(data, dtype, width) if height == 1 else 0
        if beyond:
            return _with_lost(returns, beyond)
        if height == 1 and order == "<":
            start = _after_header(payload, self.definition) + 8
            if len(self._known) < 16:
                self._known[payload[start : len(payload) - len(data) - 9]] = _Shape(dtype, plan)
        return returns

    def returns_of_rows(self, rows: np.ndarray, lengths: np.ndarray) -> tuple[Returns, np.ndarray] | None:
        """Read many one-row clouds at once; None unless all have the frame and field description of an earlier cloud.

        Args:
            rows: (n, size) uint8, whole messages.
            lengths: (n,) length of each message.

        Returns:
            all returns, and the number of returns of each cloud.
        """
        try:
            start = _after_header(rows[0].tobytes(), self.definition)
        except struct.error:
            return None
        for block, shape in self._known.items():
            end = start + 8 + len(block)
            if end + 8 > min(rows.shape[1], int(lengths.min())):
                continue
            numbers = np.ascontiguousarray(rows[:, start : start + 8]).view("<u4").astype(np.int64)
            sizes = np.ascontiguousarray(rows[:, end + 4 : end + 8]).view("<u4")[:, 0].astype(np.int64)
            width, step = numbers[:, 1], shape.dtype.itemsize
            alike = rows[:, start + 8 : end].tobytes() == block * len(rows) and (numbers[:, 0] == 1).all()
            same_frame = rows[:, 12:16].tobytes() == rows[0, 12:16].tobytes() * len(rows)
            if alike and same_frame and (width * step == sizes).all() and (end + 8 + sizes <= lengths).all():
                returns = _returns(_points_of_rows(rows, end + 8, width, shape.dtype), shape.plan)
                after = np.minimum(end + 8 + sizes, rows.shape[1] - 1)
                return _unless_marked(returns, rows[np.arange(len(rows)), after] != 0, width), width
        return None


def lidar_like(plan: ColumnPlan, names: Iterable[str], points: int) -> bool:
    """Return whether a cloud may be a lidar's: it has no speed, and either too many points or a lidar's columns only."""
    if plan.doppler is not None or plan.velocity or names_a_speed(names):
        return False
    return points > _LIDAR_POINTS or not plan.looks_like_radar


def _plan_like(first: ColumnPlan, names: Iterable[str]) -> ColumnPlan | None:
    """Plan a later message of a topic, which may have other columns of the same layout."""
    names = set(names)
    if names.issuperset((*first.columns, *(name for name in first.claimed if name))):
        return first
    plan = plan_names("cloud", names, StatedReading(axes=first.axes))
    if plan is None or first.polar or first.scales != plan.scales:
        return None
    return replace(plan, claiming=first.claiming, azimuth_from=first.azimuth_from, mount=first.mount)


def _after_header(payload: bytes, definition: Definition) -> int:
    """Return the offset of the fields after the header; in both serialisations the frame's length is at byte 12."""
    end = 16 + int(struct.unpack_from("<I", payload, 12)[0])
    return end + (-end % 4 if definition.encoding == "cdr" else 0)


def _point_dtype(message: Message, order: str) -> np.dtype[Any]:
    """Build the dtype of one point from the PointField list, including padding."""
    step = message.whole("point_step")
    big = bool(message.whole("is_bigendian"))
    names, formats, offsets = [], [], []
    if not 0 < step <= _MAX_POINT_STEP:
        raise MessageError(f"a cloud has points of {step} bytes; 1 to {_MAX_POINT_STEP} are supported")
    for point_field in message.messages("fields"):
        name, code = point_field.text("name"), _FORMATS.get(point_field.whole("datatype"))
        if code is None:
            raise MessageError(
                f"cloud field '{name}' has the unknown datatype {point_field.whole('datatype')}; 1 to 8 are defined"
            )
        offset = point_field.whole("offset")
        if offset + int(code[1]) > step:
            raise MessageError(f"cloud field '{name}' at byte {offset} does not fit into points of {step} bytes")
        if name and name not in names:
            names.append(name)
            formats.append((">" if big else "<") + code)
            offsets.append(offset)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": step})


def _points_of_rows(rows: np.ndarray, start: int, width: np.ndarray, dtype: np.dtype[Any]) -> np.ndarray:
    """Return the points of many clouds: an (n, width) view if all clouds have the same size, otherwise concatenated.

    Args:
        rows: (n, size) whole messages.
        start: offset of the points in a row.
        width: (n,) number of points of each cloud.
        dtype: of a point.
    """
    if (width == width[0]).all():
        shape, strides = (len(rows), int(width[0]), dtype.itemsize), (rows.strides[0], dtype.itemsize, 1)
        return as_strided(rows[:, start:], shape, strides, writeable=False).view(dtype)[..., 0]
    ends = np.cumsum(width)
    points = np.empty(int(ends[-1]), dtype=dtype)
    raw = points.view(np.uint8)
    for row, size, end in zip(rows, (width * dtype.itemsize).tolist(), (ends * dtype.itemsize).tolist(), strict=True):
        raw[end - size : end] = row[start : start + size]
    return points


def _points(data: np.ndarray, dtype: np.dtype[Any], height: int, width: int, row_step: int) -> np.ndarray:
    """View the bytes as points, including padded rows."""
    count, used = height * width, width * dtype.itemsize
    if not count:
        return np.zeros(0, dtype=dtype)
    row_step = row_step if height > 1 else max(row_step, used)
    if row_step < used or len(data) < row_step * (height - 1) + used:
        raise MessageError(
            f"a cloud of {height} x {width} points of {dtype.itemsize} bytes (rows of {row_step}) "
            f"has only {len(data)} bytes of data"
        )
    rows = np.ndarray((height, used), np.uint8, np.ascontiguousarray(data), 0, (row_step, 1))
    return np.ascontiguousarray(rows).reshape(-1).view(dtype)


def cloud_columns(samples: Samples) -> list[str]:
    """Return the fields of a first cloud.

    Raises:
        MessageError: the message is inconsistent.
    """
    message = decode(samples.definition, samples.payload)
    return list(_point_dtype(message, payload_byte_order(samples.payload, samples.definition)).names or ())


def _cloud_columns(samples: Samples, dtype: np.dtype[Any]) -> list[DescribedColumn]:
    """Describe the fields of a cloud with their values in a few messages of the same layout."""
    scans = [np.zeros(0, dtype)]
    for payload in samples.payloads():
        try:
            message = decode(samples.definition, payload)
            if _point_dtype(message, payload_byte_order(payload, samples.definition)) == dtype:
                size = (message.whole(name) for name in ("height", "width", "row_step"))
                scans.append(_points(message.octets("data"), dtype, *size))
        except MessageError:
            continue
    points = np.concatenate(scans)
    with np.errstate(invalid="ignore"):
        return [
            DescribedColumn(name, dtype[name].kind != "f", "", points[name].astype(np.float64))
            for name in dtype.names or ()
        ]


def _unless_marked(returns: Returns, dense: np.ndarray, counts: np.ndarray) -> Returns:
    """Count no return as lost in a cloud that says that it has invalid ones, unless it has no valid one.

    Args:
        returns: of some clouds.
        dense: (m,) whether each says that all its returns are valid.
        counts: (m,) number of returns of each.
    """
    if returns.lost is None or dense.all():
        return returns
    cloud = np.repeat(np.arange(len(counts)), counts)
    marked = ~dense & (np.bincount(cloud, returns.lost, len(counts)) < counts)
    return replace(returns, lost=returns.lost & ~marked[cloud])


def _points_beyond_width(data: np.ndarray, dtype: np.dtype[Any], width: int) -> int:
    """Return how many points lie in the data beyond the width that the message states, up to the last that is not all zero."""
    rest = data[width * dtype.itemsize :]
    filled = np.flatnonzero(rest[: len(rest) // dtype.itemsize * dtype.itemsize])
    return int(filled[-1]) // dtype.itemsize + 1 if len(filled) else 0


def _with_lost(returns: Returns, count: int) -> Returns:
    """Add returns without a position: those that a message holds beyond its stated width."""
    no_position, nothing = np.full((count, 3), np.nan), np.full(count, np.nan)
    lost = np.zeros(len(returns), dtype=np.bool_) if returns.lost is None else returns.lost
    lost = np.concatenate([lost, np.ones(count, dtype=np.bool_)])
    return replace(
        returns,
        points_radar_m=np.concatenate([returns.points_radar_m, no_position]),
        doppler_mps=np.concatenate([returns.doppler_mps, nothing]),
        snr_db=np.concatenate([returns.snr_db, nothing]),
        sigma_polar=np.concatenate([returns.sigma_polar, no_position]),
        lost=lost,
    )


def _returns(points: np.ndarray, plan: ColumnPlan) -> Returns:
    if not points.size:
        return no_returns()
    return returns_from(plan, lambda name: points[name])


def is_channel_cloud(definition: Definition) -> bool:
    """Return whether a message is laid out as sensor_msgs/PointCloud."""
    return definition.names >= {"points", "channels"}


@dataclass(frozen=True, slots=True, eq=False)
class ChannelCloudLayout:
    """Reads sensor_msgs/PointCloud: points as float32 x, y, z, and other quantities in named channels (Oculii)."""

    definition: Definition
    plan: ColumnPlan
    lidar_like: bool

    one_per_message = False

    @classmethod
    def recognise(cls, samples: Samples, stated: StatedReading = NOTHING_STATED) -> "ChannelCloudLayout | None":
        """Recognize the layout from a first message."""
        definition = samples.definition
        columns = _channel_columns(decode(definition, samples.payload))
        within = stated.within("", list(columns))
        if within is None:
            return None
        described = [DescribedColumn(name, False, "", values) for name, values in columns.items()]
        plan = plan_described("channels", described, stated=within)
        if plan is None:
            return None
        return cls(definition, plan, lidar_like(plan, columns, len(columns["x"])))

    @property
    def description(self) -> str:
        """Describe what is read."""
        return self.plan.describe()

    def returns(self, payload: bytes) -> Returns:
        """Read one cloud.

        Raises:
            MessageError: a column of the first message is missing.
        """
        columns = _channel_columns(decode(self.definition, payload))
        if not len(columns["x"]):
            return no_returns()
        try:
            return returns_from(self.plan, lambda name: columns[name])
        except KeyError as error:
            raise MessageError(f"a cloud lacks the channel {error} of the first cloud") from error


def _channel_columns(message: Message) -> dict[str, np.ndarray]:
    columns = {axis: message.column("points", axis) for axis in "xyz"} if message.count("points") else {}
    columns = columns or {axis: np.zeros(0) for axis in "xyz"}
    for number, channel in enumerate(message.messages("channels")):
        values = channel.numbers("values", channel.count("values"))
        if len(values) == len(columns["x"]):
            columns.setdefault(channel.text("name") or f"channel{number}", values)
    return columns
