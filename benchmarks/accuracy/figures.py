"""Turn the raw figures of many trials into ratios and shares, each with two standard errors, and into verdicts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.rows import Claim, Figures

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
    """Return the verdict; above the limit by less than two standard errors, or nothing to judge, is undecided."""
    if measured.value <= limit:
        return MET
    beyond = np.isposinf(measured.value) or measured.value - measured.error > limit
    return MISSED if beyond else UNDECIDED


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


def low(covered: Measured) -> bool:
    """Return whether a share that is stated to be 95 % is significantly below."""
    return at_least(covered, 95.0) == MISSED


def counted(count: float, total: int) -> Measured:
    """Return the share of a count."""
    return share((np.arange(total) < count).astype(np.float64))


def rmse(trials: Sequence[Figures], name: str) -> float:
    """Return the root mean square of one figure over the trials that have it."""
    return float(np.sqrt(np.nanmean(column(trials, name) ** 2)))


def stated_over_rmse(trials: Sequence[Figures], stated: str, name: str) -> Measured:
    """Return the mean stated sigma over the RMSE; two standard errors from those of the mean of the squares."""
    sigmas, errors = column(trials, stated), column(trials, name)
    used = np.isfinite(sigmas) & np.isfinite(errors)
    if used.sum() < 2:
        return Measured(float("nan"), float("nan"))
    squares = errors[used] ** 2
    value = float(sigmas[used].mean() / np.sqrt(squares.mean()))
    return Measured(value, float(value * np.std(squares, ddof=1) / np.sqrt(used.sum()) / squares.mean()))


def tally(aim: str, judged: Sequence[tuple[str, str, str]]) -> Claim:
    """Combine rows, each a name, a figure and a verdict, into one claim that names every row that misses the aim."""
    counts = [f"{sum(verdict == MET for _, _, verdict in judged)} of {len(judged)} met"]
    undecided = sum(verdict == UNDECIDED for _, _, verdict in judged)
    counts += [f"{undecided} undecided"] if undecided else []
    missed = [f"{name} {figure}" for name, figure, verdict in judged if verdict == MISSED]
    counts += [f"missed: {', '.join(missed)}"] if missed else []
    return Claim(aim, "; ".join(counts), worst(verdict for _, _, verdict in judged))
