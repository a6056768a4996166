"""What the words of a name state: a quantity, its unit, and whether it is a standard deviation or a second hypothesis."""

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, replace

from calib_core.recordings.field_words.spellings import SPELLINGS, Spelling
from calib_core.recordings.field_words.units import Unit, dimension_of, unit_of_words
from calib_core.recordings.field_words.words import (
    BLOCKERS,
    FILLERS,
    NUMBERS,
    SECOND,
    STATISTICS,
    TYPE_PREFIXES,
    folded,
)

_QUANTITIES = {"longitudinal": "x", "lateral": "y", "radial": "doppler", "vague": "azimuth"}
_MOST_WORDS_OF_A_UNIT = 3


@dataclass(frozen=True, slots=True)
class NamedQuantity:
    """What a name states.

    Attributes:
        spelling: of the quantity.
        words: of the name, without type prefixes, fillers and unit.
        unit: None if the name states none.
        sigma: it is the quantity's standard deviation.
        second: it is a second hypothesis, such as azimuth2.
        numbered: it is the first or a further hypothesis, such as azimuth1.
    """

    spelling: Spelling
    words: tuple[str, ...]
    unit: Unit | None = None
    sigma: bool = False
    second: bool = False
    numbered: bool = False

    @property
    def quantity(self) -> str:
        """One of x, y, z, range, azimuth, elevation, doppler, vx, vy, vz, snr, intensity, rcs, power and amplitude."""
        return quantity_of(self.spelling)


def quantity_of(spelling: Spelling) -> str:
    """Return the quantity of a spelling: x for longitudinal, doppler for radial."""
    return _QUANTITIES.get(spelling.kind, spelling.kind)


def spelt(spellings: Iterable[Spelling]) -> Mapping[frozenset[str], Spelling]:
    """Return spellings by the set of their words; of two with the same words, the first."""
    found: dict[frozenset[str], Spelling] = {}
    for one in spellings:
        words = frozenset(folded(one.words.split()))
        found.setdefault(words - FILLERS or words, one)
    return found


SPELT: Mapping[frozenset[str], Spelling] = spelt(SPELLINGS)
"""The shared spellings."""


def named_quantity(
    words: tuple[str, ...],
    known: Mapping[frozenset[str], Spelling] = SPELT,
    *,
    type_prefixes: Set[str] = TYPE_PREFIXES,
) -> NamedQuantity | None:
    """Return what the words of a name state; None if they name none of the known quantities.

    Args:
        words: of the name; see words_of.
        known: the reader's spellings.
        type_prefixes: that the reader drops.
    """
    if not BLOCKERS.isdisjoint(words):
        return None
    for start in range(_prefixes(words, type_prefixes) + 1):
        found = _with_unit(tuple(word for word in words[start:] if word not in FILLERS), known)
        if found is not None:
            return found
    return None


def _prefixes(words: tuple[str, ...], type_prefixes: Set[str]) -> int:
    """Return how many leading words may be dropped: type prefixes, only if something remains."""
    count = 0
    while count < len(words) - 1 and words[count] in type_prefixes:
        count += 1
    return count


def _with_unit(words: tuple[str, ...], known: Mapping[frozenset[str], Spelling]) -> NamedQuantity | None:
    for size in range(min(_MOST_WORDS_OF_A_UNIT, len(words) - 1), 0, -1):
        unit = unit_of_words(words[-size:])
        found = _plain(words[:-size], known) if unit else None
        if unit and found and dimension_of(found.quantity) == unit.dimension:
            return replace(found, unit=unit)
    return _plain(words, known)


def _plain(words: tuple[str, ...], known: Mapping[frozenset[str], Spelling]) -> NamedQuantity | None:
    numbering = SECOND | NUMBERS
    spelling = known.get(frozenset(words) - STATISTICS - numbering)
    if spelling is None:
        return None
    return NamedQuantity(
        spelling,
        words,
        sigma=not STATISTICS.isdisjoint(words),
        second=not SECOND.isdisjoint(words),
        numbered=not numbering.isdisjoint(words),
    )
