"""How JSON states what msgspec does not know: a type with another form there names it as its `json_form`.

One pair of hooks reads and writes them in every file, journal and message. Below are the ranges of the numbers in our files.
"""

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta

Measured = Annotated[float, Meta(ge=-1e9, le=1e9)]
"""The bound is far beyond any position, pixel or coefficient; it keeps what is computed from them finite."""
Positive = Annotated[float, Meta(ge=1e-12, le=1e9)]
"""A standard deviation; its square and the reciprocal of that are far from overflowing."""
Scale = Annotated[float, Meta(gt=-1.0, le=1e9)]
"""A scale minus 1: -1 would be a scale of 0."""
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Count = Annotated[int, Meta(ge=0)]
Name = Annotated[str, Meta(min_length=1, max_length=200)]
Pixel = tuple[Measured, Measured]
Position = tuple[Measured, Measured, Measured]


class _Stated(type):
    """The class of types that stand for another one in Python, `kind`, because JSON states its values in another form."""

    kind: type

    def __instancecheck__(cls, value: object) -> bool:
        return isinstance(value, cls.kind)


if TYPE_CHECKING:
    Figure: TypeAlias = float
else:

    class Figure(metaclass=_Stated):
        """A number that may be unknown: NaN in Python, null in JSON."""

        kind = float
        json_form = float | None

        @staticmethod
        def from_json(form):
            """Return the number."""
            return float("nan") if form is None else form


def to_json(value: Any) -> Any:
    """Give msgspec the JSON form of a value, as its `enc_hook`; an array row by row.

    Raises:
        NotImplementedError: it has none.
    """
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if hasattr(value, "json_form"):
        return value.json_form.of(value)
    raise NotImplementedError(f"{type(value).__name__} has no JSON form")


def from_json(kind: Any, value: Any) -> Any:
    """Read a value from its JSON form for msgspec, as its `dec_hook`.

    Raises:
        NotImplementedError: its type has no JSON form.
        ValueError: it is not in that form.
    """
    if not hasattr(kind, "json_form"):
        raise NotImplementedError(f"{kind.__name__} has no JSON form")
    try:
        return kind.from_json(msgspec.convert(value, kind.json_form))
    except msgspec.ValidationError as error:
        raise ValueError(str(error).replace(" - at `$.", " in `")) from error  # msgspec adds the place


def form_of(kind: Any) -> Any:
    """Return the type that states a type's values in JSON: another one, or itself."""
    return getattr(kind, "json_form", kind)
