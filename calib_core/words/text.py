"""Text that people read: words with pairs and options in between, which each reader is shown by their own names.

A `Words` is no string: it cannot be compared with one, searched or cut. It is made here, last, and rendered once: a page receives
its parts, a terminal and a file its text.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from string import Formatter
from typing import Final, TypeAlias


@dataclass(frozen=True, slots=True)
class PairPart:
    """A pair (or its click) within words, by its id."""

    pair: str


@dataclass(frozen=True, slots=True)
class OptionPart:
    """An option within words, by its path, with the value that it is to have; "" if the reader chooses it."""

    option: str
    value: str = ""


Part: TypeAlias = str | PairPart | OptionPart
_MOST_LISTED: Final = 6


@dataclass(frozen=True, slots=True)
class Words:
    """Text with pairs and options in between.

    Attributes:
        parts: in their order.
    """

    parts: tuple[Part, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.parts)

    def __add__(self, more: "Words | str") -> "Words":
        return _merge_strings((*self.parts, *words(more).parts))

    def __radd__(self, before: str) -> "Words":
        return _merge_strings((before, *self.parts))

    def __str__(self) -> str:
        return self.text()

    def with_degree_signs(self) -> "Words":
        """Return it with "2°" for "2 deg"."""
        return Words(tuple(with_degree_signs(part) if isinstance(part, str) else part for part in self.parts))

    def text(
        self, pair: Callable[[str], str] = str, option: Callable[[OptionPart], str] = lambda part: option_text(part)
    ) -> str:
        """Return it as one line.

        Args:
            pair: what a pair with an id is called; its id as it is by default, as in files.
            option: how an option is written; by its path and value by default, as in files.
        """
        return "".join(
            part if isinstance(part, str) else pair(part.pair) if isinstance(part, PairPart) else option(part)
            for part in self.parts
        )


def option_text(part: OptionPart) -> str:
    """Return an option as files and Python name it: "gating.max_range_m" or "radar_axes=forward,right,up"."""
    return f"{part.option}={part.value}" if part.value else part.option


_DEGREES = re.compile(r"(?<=\d) deg\b")


def with_degree_signs(text: str) -> str:
    """Return the text with "2°" for "2 deg"."""
    return _DEGREES.sub("°", text)


def sentence(phrase: "Words | str") -> Words:
    """Capitalize a phrase and add a full stop; an empty one stays empty, names such as /radar or c14 are not capitalized.

    Degrees have their sign.
    """
    parts = list(words(phrase).with_degree_signs().parts)
    if not parts:
        return Words()
    if isinstance(first := parts[0], str):
        first = first.lstrip()
        begins = first.split()[0].rstrip(",:;.…").isalpha() if first.split() else False
        parts[0] = (first[:1].upper() if begins else first[:1]) + first[1:]
    if not isinstance(last := parts[-1], str) or last.rstrip()[-1:] not in (".", "!", "?", "…"):
        parts.append(".")
    return _merge_strings(parts)


def words(text: Words | str) -> Words:
    """Return text as words; words stay as they are."""
    return text if isinstance(text, Words) else Words((text,) if text else ())


def say(template: str, /, **values: object) -> Words:
    """Fill a template as `str.format` does; values that are `Words` keep their parts.

    Args:
        template: with named fields, such as "{pair} is {away_px:.1f} px away".
        values: of the fields.
    """
    parts: list[Part] = []
    for literal, name, spec, _ in Formatter().parse(template):
        parts.append(literal)
        if name is None:
            continue
        value = values[name]
        parts.extend(value.parts if isinstance(value, Words) else (format(value, spec or ""),))
    return _merge_strings(parts)


def _merge_strings(parts: Iterable[Part]) -> Words:
    """Merge neighboring strings, so that equal words have equal parts."""
    merged: list[Part] = []
    for part in parts:
        if isinstance(part, str) and merged and isinstance(merged[-1], str):
            merged[-1] += part
        elif part:
            merged.append(part)
    return Words(tuple(merged))


def join(all_words: Iterable[Words | str], between: str = " ") -> Words:
    """Join those that are not empty."""
    joined = Words()
    for one in map(words, all_words):
        joined = joined + (between if joined and one else "") + one
    return joined


def named(name: str) -> Words:
    """Return a pair."""
    return Words((PairPart(name),))


def listed(names: Sequence[str], most: int = _MOST_LISTED) -> Words:
    """List the first pairs and count the rest."""
    first = join(map(named, names[:most]), ", ")
    return first if len(names) <= most else first + f" and {len(names) - most} more"


def option(path: str, value: str = "") -> Words:
    """Return an option, with the value that it is to have."""
    return Words((OptionPart(path, value),))


def count(number: int, noun: str) -> str:
    """Return a number with its noun: "1 click", "3 clicks"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
