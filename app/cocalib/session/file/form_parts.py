"""Parts that the JSON forms of steps share."""

from typing import Annotated

import msgspec
from msgspec import Meta

from calib_core.measurements import Stamp


class StampForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A time."""

    sec: Annotated[int, Meta(ge=0, le=9_223_372_035)]
    nanosec: Annotated[int, Meta(ge=0, le=999_999_999)]

    @classmethod
    def of(cls, stamp: Stamp) -> "StampForm":
        """Convert a stamp to its JSON form."""
        return cls(stamp.sec, stamp.nanosec)

    @property
    def stamp(self) -> Stamp:
        """The stamp as the session uses it."""
        return Stamp(self.sec, self.nanosec)


class StepPart(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A JSON object with a "type"."""
