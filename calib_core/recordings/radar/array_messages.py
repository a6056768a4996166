"""Read radar messages that hold their returns as parallel arrays of equal length (Delphi's Ethernet driver)."""

from dataclasses import dataclass, replace

from calib_core.recordings.messages.decoding import decode
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition
from calib_core.recordings.radar.column_plans import find_decoder, plan_for
from calib_core.recordings.radar.columns import ColumnPlan, Returns, no_returns, returns_from

__all__ = ["ArrayLayout"]


@dataclass(frozen=True, slots=True, eq=False)
class ArrayLayout:
    """Reads messages of fixed arrays; only layouts in the registry, since parallel arrays may hold anything.

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
        """Recognise a message by the names of its arrays."""
        names = [field.name for field in definition.fields if field.count and field.type in PRIMITIVES]
        decoder, plan = find_decoder("arrays", names), plan_for("arrays", names)
        if decoder is None or plan is None:
            return None
        return cls(definition, plan, decoder.count_field if decoder.count_field in definition.names else None)

    @property
    def description(self) -> str:
        """Describe what is read."""
        return f"parallel arrays: {self.plan.describe()}"

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
        """Return the same layout with another plan."""
        return replace(self, plan=plan)
