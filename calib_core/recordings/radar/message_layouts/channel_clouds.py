"""Read radar returns from sensor_msgs/PointCloud, the older cloud with named channels."""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.radar.column_mapping import StatedReading
from calib_core.recordings.radar.column_plan import ColumnPlan
from calib_core.recordings.radar.column_plans import plan_described
from calib_core.recordings.radar.columns import Returns, no_returns, returns_from
from calib_core.recordings.radar.message_layouts.point_clouds import lidar_like
from calib_core.recordings.radar.message_layouts.samples import Samples
from calib_core.recordings.radar.self_describing.candidates import DescribedColumn

_NOTHING = StatedReading()


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
    def recognise(cls, samples: Samples, stated: StatedReading = _NOTHING) -> "ChannelCloudLayout | None":
        """Recognise the layout from a first message."""
        definition = samples.definition
        columns = _channel_columns(decode(definition, samples.payload))
        within = stated.within("", list(columns))
        if within is None:
            return None
        plan = plan_described("channels", [DescribedColumn(name, False, "", v) for name, v in columns.items()])
        plan = within.applied(plan)
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

    def with_plan(self, plan: ColumnPlan) -> "ChannelCloudLayout":
        """Return the same layout with another plan."""
        return replace(self, plan=plan)


def _channel_columns(message: Message) -> dict[str, np.ndarray]:
    columns = {axis: message.column("points", axis) for axis in "xyz"} if message.count("points") else {}
    columns = columns or {axis: np.zeros(0) for axis in "xyz"}
    for number, channel in enumerate(message.messages("channels")):
        values = channel.numbers("values", channel.count("values"))
        if len(values) == len(columns["x"]):
            columns.setdefault(channel.text("name") or f"channel{number}", values)
    return columns
