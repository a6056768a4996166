"""Turn the raw figures of many trials into ratios and shares, each with two standard errors, and into verdicts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.rows import Claim, Figures, Kept

__all__ = [
    "MET",
    "MISSED",
    "UNDECIDED",
    "Measured",
    "at_least",
    "at_most",
    "column",
    "fewest",
    "joined",
    "ratio",
    "share",
    "summed_up",
    "within",
    "worst",
]

MET, UNDECIDED, MISSED = "met", "undecided", "**missed**"


@dataclass(frozen=True, slots=True)
class Measured:
    """A figure and its two standard errors."""

    value: float
    error: float

    def __str__(self) -> str:
        if not np.isfinite(self.value):
            return "-"
        if self.value >= 10.0:
            return f"{self.value:.0f}"
        return f"{self.value:.2f} ± {self.error:.2f}" if self.error < 1.0 else f"{self.value:.1f}"

    @property
    def percent(self) -> str:
        """The figure as text; it is already in percent."""
        return f"{self.value:.1f} ± {self.error:.1f} %" if np.isfinite(self.value) else "-"


def column(trials: Sequence[Figures], name: str) -> np.ndarray:
    """Return one figure of every trial; NaN if a trial has none."""
    return np.array([np.nan if (value := trial.get(name)) is None else value for trial in trials], dtype=np.float64)


def ratio(errors: np.ndarray, bounds: np.ndarray) -> Measured:
    """Return the RMSE divided by the root mean square of the bound, over the trials with a pose.

    The standard error is that of a ratio of means: e^2 - q^2 b^2 has mean 0 at the true ratio q.
    """
    used = np.isfinite(errors)
    if used.sum() < 2:
        return Measured(float("nan"), float("nan"))
    squares, limits = errors[used] ** 2, bounds[used] ** 2
    value = float(np.sqrt(squares.mean() / limits.mean()))
    spread = float(np.std(squares - value**2 * limits, ddof=1) / np.sqrt(used.sum()) / limits.mean())
    return Measured(value, spread / max(value, 1e-12))  # d sqrt(x) = dx / (2 sqrt(x)), twice


def share(flags: np.ndarray) -> Measured:
    """Return the share in percent of flags that are not NaN; the error uses Wilson's centre, so that 0 of n has one too."""
    used = flags[np.isfinite(flags)]
    if not len(used):
        return Measured(float("nan"), float("nan"))
    smoothed = (used.sum() + 2.0) / (len(used) + 4.0)
    return Measured(float(100.0 * used.mean()), float(200.0 * np.sqrt(smoothed * (1.0 - smoothed) / len(used))))


def at_most(measured: Measured, limit: float) -> str:
    """Return the verdict; above the limit by less than two standard errors is undecided."""
    if measured.value <= limit:
        return MET
    return UNDECIDED if measured.value - measured.error <= limit else MISSED


def at_least(measured: Measured, limit: float) -> str:
    """Return the verdict for a lower limit."""
    return at_most(Measured(-measured.value, measured.error), -limit)


def within(measured: Measured, low: float, high: float) -> str:
    """Return the verdict for a figure that must lie between two limits."""
    return worst([at_least(measured, low), at_most(measured, high)])


def worst(verdicts: Iterable[str]) -> str:
    """Return the worst of some verdicts."""
    order = (MET, UNDECIDED, MISSED)
    return max(verdicts, key=order.index, default="not run")


def joined(verdicts: Sequence[str]) -> str:
    """Write several verdicts into one cell, or one if they agree."""
    return " / ".join(verdicts) if len(set(verdicts)) > 1 else next(iter(verdicts), "")


def fewest(kept: Kept, keys: Iterable[str]) -> str:
    """Return text with the smallest number of trials of the rows that were run."""
    counts = [len(kept[key]) for key in keys if kept.get(key)]
    return f"{min(counts):,} trials or more a row" if counts else ""


def summed_up(aim: str, verdicts: Sequence[str], trials: str) -> Claim:
    """Combine the verdicts of several rows into one claim."""
    if not verdicts:
        return Claim(aim, "not run", "not run")
    counts = [(name, verdicts.count(name)) for name in (MET, UNDECIDED, MISSED) if verdicts.count(name)]
    found = ", ".join(f"{count} {name.strip('*')}" for name, count in counts)
    return Claim(aim, f"of {len(verdicts)} figures: {found}; {trials}", worst(verdicts))
