"""What the paper states about the rows of Table I, and how far ours are from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.paper.rows import Figures, Seed

__all__ = ["PAPER", "Paper", "figures_of", "is_reached", "median_of", "missed", "order_kept", "verdict_of"]


@dataclass(frozen=True, slots=True)
class Paper:
    """What the paper states about a row, as far as it is available to us.

    Attributes:
        aed_px: None if it is not.
        cdsd_px: likewise.
        ratio: AED over CDSD, where only that is.
        limit: how far ours may be, as a share.
    """

    aed_px: float | None = None
    cdsd_px: float | None = None
    ratio: float | None = None
    limit: float = 0.15


PAPER: Mapping[str, Paper] = {
    "PPM+D1": Paper(15.31, 9.40),
    "PPM+D2": Paper(ratio=2.65),
    "PPM+D3": Paper(11.03, 8.18),
    "PPM+DR-A": Paper(),
    "PPM+DR-B": Paper(),
    "PMM+D1": Paper(79.0, 19.0, limit=0.25),
    "R_PPM+T_m+D1": Paper(15.31 + 0.55, limit=0.25),
    "R_I+T_c+D1": Paper(79.0 + 7.7, limit=0.25),
}
"""The rows that are repeated, in the order of the table; the paper's ninth, by checkerboard (CCM), is not."""


def verdict_of(name: str, figures: Sequence[Figures]) -> str:
    """Say whether a row reaches its limit, by how much each figure is off, and what the limit is."""
    off = _off(name, figures)
    if not off:
        return "no figure to compare with"
    by = ", ".join(f"{what} {100 * one:+.0f} %" for what, one in off.items())
    return f"{'reached' if is_reached(name, figures) else 'missed'}: {by}; limit {100 * PAPER[name].limit:.0f} %"


def is_reached(name: str, figures: Sequence[Figures]) -> bool:
    """Return whether no figure of a row is further off than its limit; True where there is none to compare with."""
    return all(abs(one) <= PAPER[name].limit for one in _off(name, figures).values())


def missed(seeds: Sequence[Seed]) -> str:
    """Name the rows that miss their limit."""
    found = {name: figures_of(name, seeds) for name in PAPER}
    lines = [
        f"{name} ({verdict_of(name, one).removeprefix('missed: ')})"
        for name, one in found.items()
        if one and not is_reached(name, one)
    ]
    return f"Rows that miss their limit: {'; '.join(lines)}." if lines else "No row misses its limit."


def order_kept(seeds: Sequence[Seed]) -> str:
    """Say whether the rows whose AED the paper gives stand in the paper's order."""
    known = {name: stated.aed_px for name, stated in PAPER.items() if stated.aed_px is not None}
    theirs = sorted(known, key=lambda name: known[name] or 0.0)
    ours = sorted(known, key=lambda name: median_of(figures_of(name, seeds), "aed_px"))
    return f"The paper's order of AED is {' < '.join(theirs)}. Ours is {'the same' if ours == theirs else ' < '.join(ours)}."


def figures_of(name: str, seeds: Sequence[Seed]) -> list[Figures]:
    """Return one row of every seed that has it."""
    return [seed.rows[name] for seed in seeds if name in seed.rows]


def median_of(figures: Sequence[Figures], name: str) -> float:
    """Return the median of one figure over the seeds where it is finite; NaN if it nowhere is."""
    values = np.array([getattr(one, name) for one in figures])
    return float(np.median(values[np.isfinite(values)])) if np.isfinite(values).any() else float("nan")


def _off(name: str, figures: Sequence[Figures]) -> dict[str, float]:
    """Return how far each figure that the paper gives is off, as a share."""
    stated = PAPER[name]
    aed, cdsd = median_of(figures, "aed_px"), median_of(figures, "cdsd_px")
    pairs = {"AED": (aed, stated.aed_px), "CDSD": (cdsd, stated.cdsd_px), "AED / CDSD": (aed / cdsd, stated.ratio)}
    return {what: ours / theirs - 1.0 for what, (ours, theirs) in pairs.items() if theirs is not None}
