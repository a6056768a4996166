"""What the paper states in Table I, and whether ours reproduces it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from benchmarks.paper.rows import Seed

Judgement: TypeAlias = Literal["reproduced", "compatible", "order of magnitude", "not reproduced"]
PAPER: Mapping[str, tuple[float, float]] = {
    "PPM+D1": (15.31, 9.40),
    "PMM+D1": (79.38, 19.08),
    "CCM+D2": (7.38, 4.39),
    "PPM+D2": (16.87, 6.37),
    "CCM+D1": (8935.97, 14403.44),
    "PPM+D1+T_m": (15.86, 9.07),
    "PMM+D1+T_c": (87.07, 18.62),
    "PPM+D3": (11.03, 8.18),
    "PPM+DR+D3": (53.90, 70.13),
}
"""AED and CDSD [px], in the order of the table."""
CHOSEN_ROW = "PPM+DR+D3"
"""Its gross errors are an assumption that was chosen for it."""
_NEAR, _WIDE, _VERY_WIDE = 0.25, 2.0, 10.0
_NINETY = 1.645
"""Standard deviations on each side of a normal distribution's middle 90 %."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One figure of one row over the seeds.

    Attributes:
        paper_px: what the paper states.
        median_px: ours.
        low_px: end of the range that 90 % of seeds are in, by a log-normal distribution.
        high_px: its other end.
    """

    paper_px: float
    median_px: float
    low_px: float
    high_px: float

    @property
    def judgement(self) -> Judgement:
        """Whether the paper's value is in our range; the wider our range, the less that says."""
        if not self.holds_paper:
            return "not reproduced"
        if self.high_px > _VERY_WIDE * self.low_px:
            return "order of magnitude"
        if self.high_px > _WIDE * self.low_px:
            return "compatible"
        return "reproduced" if abs(self.off) <= _NEAR else "not reproduced"

    @property
    def holds_paper(self) -> bool:
        """Whether the paper's value is in our range."""
        return self.low_px <= self.paper_px <= self.high_px

    @property
    def off(self) -> float:
        """How far the median is off, as a share of the paper's value."""
        return self.median_px / self.paper_px - 1.0


def judged(name: str, seeds: Sequence[Seed]) -> tuple[Judged, Judged]:
    """Judge AED and CDSD of a row."""
    rows = [seed.rows[name] for seed in seeds if name in seed.rows]
    both = zip(PAPER[name], np.array([(row.aed_px, row.cdsd_px) for row in rows]).T, strict=True)
    aed, cdsd = (Judged(paper_px, float(np.median(ours)), *_range(ours)) for paper_px, ours in both)
    return aed, cdsd


def row_judgement(name: str, seeds: Sequence[Seed]) -> str:
    """Say of a row whether it is reproduced; if not, why."""
    figures = dict(zip(("AED", "CDSD"), judged(name, seeds), strict=True))
    missed = [
        f"{what} is {100 * one.off:+.0f} %{'' if one.holds_paper else ', outside our range'}"
        for what, one in figures.items()
        if one.judgement == "not reproduced"
    ]
    if missed:
        return f"not reproduced, because {' and '.join(missed)}"
    if any(one.judgement == "order of magnitude" for one in figures.values()):
        return "reproduced in order only"
    loose = [what for what, one in figures.items() if one.judgement == "compatible"]
    return (
        "compatible" if len(loose) == len(figures) else f"reproduced; {loose[0]} compatible" if loose else "reproduced"
    )


def verdict(name: str, sets: Sequence[Sequence[Seed]]) -> str:
    """Say of a row whether it is reproduced, for each set of seeds where they differ."""
    said = dict.fromkeys(row_judgement(name, seeds) for seeds in sets)
    chosen = "under an assumption chosen for it: " if name == CHOSEN_ROW else ""
    return f"{chosen}{'; with the other seeds '.join(said)}"


def differing(first: Sequence[Seed], second: Sequence[Seed]) -> list[str]:
    """Name the figures, of 18, that two sets of seeds judge differently, with what the rule goes by."""
    both = [(name, zip(judged(name, first), judged(name, second), strict=True)) for name in PAPER]
    return [
        f"{what} of {name}: {a.judgement} and {b.judgement} (ends of our range {a.high_px / a.low_px:.2f} and "
        f"{b.high_px / b.low_px:.2f} times apart, median off by {100 * a.off:+.0f} and {100 * b.off:+.0f} %)"
        for name, figures in both
        for what, (a, b) in zip(("AED", "CDSD"), figures, strict=True)
        if a.judgement != b.judgement
    ]


def _range(values: np.ndarray) -> tuple[float, float]:
    """Return the middle 90 % of the log-normal distribution fitted to the values; 20 values hardly show their own 5 % points."""
    logs = np.log(values)
    low, high = np.exp(np.mean(logs) + _NINETY * np.std(logs, ddof=1) * np.array([-1.0, 1.0]))
    return float(low), float(high)
