"""What a page asks for when it reviews an answer: all pairs, one pair, two solutions, the uncertainty in the picture."""

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

from cocalib.view.contours import ContourMap

SolutionKind: TypeAlias = Literal["now", "default", "paper", "toggled", "before", "reference", "file"]


class _Form(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A request; what it asks for is sent as a message of its own."""


class ReviewWanted(_Form, frozen=True, tag="review"):
    """The review of all pairs is requested."""


class PairReviewWanted(_Form, frozen=True, tag="review_pair"):
    """The review of one pair is requested."""

    id: Annotated[str, Meta(max_length=100)]


class CompareWanted(_Form, frozen=True, tag="compare"):
    """Two solutions are to be compared; the content of a file is sent once, and kept for later requests of the page."""

    a: SolutionKind
    b: SolutionKind
    pair: Annotated[str, Meta(max_length=100)] | None = None
    file_name: Annotated[str, Meta(max_length=300)] = ""
    file_base64: str = ""


class UncertaintyWanted(_Form, frozen=True, tag="uncertainty"):
    """The contours of the uncertainty in the picture are requested."""


ReviewRequest: TypeAlias = ReviewWanted | PairReviewWanted | CompareWanted | UncertaintyWanted


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Where points at several distances may appear in the picture.

    Attributes:
        revision: of the session that the answer belongs to.
        maps: one per distance; empty without a calibration.
    """

    revision: int
    maps: tuple[ContourMap, ...]
