"""The figures of the last run, kept in measured.json: the page can be written again without measuring again."""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path

from benchmarks.paper.rows import Figures, Seed

__all__ = ["AccRow", "Measured", "read_measured", "write_measured"]

_FILE = Path(__file__).with_name("measured.json")


@dataclass(frozen=True, slots=True)
class AccRow:
    """Acc of one kind of target, one value to a seed.

    Attributes:
        what: moves.
        paper: what the paper states.
        kept: by the radar's own targets, frames of 0 % kept.
        dropped: the same without those frames, as the paper's authors count.
        labelled: by the simulation's labels, frames of 0 % kept.
        turned: by the radar's own targets, with the calibration turned by 10 deg.
    """

    what: str
    paper: str
    kept: tuple[float, ...]
    dropped: tuple[float, ...]
    labelled: tuple[float, ...]
    turned: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Measured:
    """What a run measured.

    Attributes:
        date: of the run.
        seeds: the rows of each seed of the table.
        ranges: what was changed, and the rows of a few seeds.
        accs: people, robot and cars.
    """

    date: str
    seeds: tuple[Seed, ...]
    ranges: tuple[tuple[str, tuple[Seed, ...]], ...]
    accs: tuple[AccRow, ...]


def write_measured(measured: Measured, path: Path = _FILE) -> None:
    """Write the figures of a run; a figure that does not exist is NaN."""
    path.write_text(json.dumps(dataclasses.asdict(measured), indent=1) + "\n", encoding="utf-8")


def read_measured(path: Path = _FILE) -> Measured:
    """Read the figures of the last run."""
    found = json.loads(path.read_text(encoding="utf-8"))
    return Measured(
        found["date"],
        _seeds(found["seeds"]),
        tuple((what, _seeds(some)) for what, some in found["ranges"]),
        tuple(
            AccRow(**{name: tuple(one) if isinstance(one, list) else one for name, one in row.items()})
            for row in found["accs"]
        ),
    )


def _seeds(found: list[dict[str, dict[str, dict[str, float]]]]) -> tuple[Seed, ...]:
    return tuple(Seed({name: Figures(**figures) for name, figures in seed["rows"].items()}) for seed in found)
