"""Radar messages whose returns are columns already: arrays of one length side by side (Delphi's Ethernet driver)."""

from dataclasses import dataclass, replace

from calib_core.recordings.messages.decoding import decode
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition
from calib_core.recordings.radar.column_plans import find_decoder, plan_for
from calib_core.recordings.radar.columns import ColumnPlan, Returns, no_returns, returns_from

__all__ = ["ArrayLayout"]


@dataclass(frozen=True, slots=True, eq=False)
class ArrayLayout:
    """Reads messages of fixed arrays; only those of the registry, since arrays side by side may be anything.

    Attributes:
        definition: of the message.
        plan: which arrays are used.
        count_field: how many elements of the arrays hold returns.
    """

    definition: Definition
    plan: ColumnPlan
    count_field: str | None

    one_per_message = False
    lidar_like = False

    @classmethod
    def recognise(cls, definition: Definition) -> "ArrayLayout | None":
        """Look at the names of a message's arrays."""
        names = [field.name for field in definition.fields if field.count and field.type in PRIMITIVES]
        decoder, plan = find_decoder("arrays", names), plan_for("arrays", names)
        if decoder is None or plan is None:
            return None
        return cls(definition, plan, decoder.count_field if decoder.count_field in definition.names else None)

    @property
    def description(self) -> str:
        """Say what is read."""
        return f"arrays side by side: {self.plan.describe()}"

    def returns(self, payload: bytes) -> Returns:
        """Read one scan.

        Raises:
            MessageError: the bytes do not fit the definition.
        """
        message = decode(self.definition, payload)
        count = message.whole(self.count_field) if self.count_field else None
        if count == 0:
            return no_returns()
        return returns_from(self.plan, lambda name: message.array(name)[:count])

    def with_plan(self, plan: ColumnPlan) -> "ArrayLayout":
        """Read by another plan."""
        return replace(self, plan=plan)
