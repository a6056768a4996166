"""What the figures of many recordings come to: the aims, and the same by what is special about a recording."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from benchmarks.accuracy.rows import Figures
from benchmarks.intrinsics.tables import Table
from benchmarks.proposing.cases import case_of

__all__ = ["aims_table", "limit_95", "summed", "traits_table"]

_Row: TypeAlias = tuple[str, str, str, str]
_MANY = 200
_CLICKING = (("without", "without a click", 0.75), ("after", "after one click", 0.90))


def limit_95(bad: int, of: int) -> str:
    """Return a count with the upper limit of its share at 95 % confidence (Clopper and Pearson)."""
    from scipy.stats import beta

    limit = 1.0 if bad >= of else float(beta.ppf(0.95, bad + 1, of - bad))
    return f"{bad} of {of:,}, at most {100 * limit:.2g} % of all at 95 % confidence"


def summed(trials: Sequence[Figures], name: str) -> float:
    """Return the sum of a figure over the trials that have it."""
    return float(sum(trial.get(name) or 0.0 for trial in trials))


def _share(trials: Sequence[Figures], part: str, of: str) -> float:
    return summed(trials, part) / max(summed(trials, of), 1.0)


def _ratio(trials: Sequence[Figures], name: str) -> tuple[str, float]:
    """Compare poses with those of true clicks where both exist: ratio of the RMS errors, and the larger one as a number."""
    found = []
    for error in ("rotation_rad", "position_m"):
        pairs = [
            (one, other)
            for trial in trials
            if (one := trial.get(f"{name} {error}")) is not None and (other := trial.get(f"true {error}")) is not None
        ]
        squares = np.square(pairs).mean(axis=0) if pairs else np.full(2, np.nan)
        found.append(float(np.sqrt(squares[0] / squares[1])))
    return f"{found[0]:.2f} rotation, {found[1]:.2f} position", max(found)


def _verdict(value: float, limit: float, *, least: bool = False) -> str:
    if np.isnan(value):
        return "not measured"
    return "met" if (value >= limit if least else value <= limit) else "**missed**"


def _none(bad: int, of: int) -> str:
    """Return the verdict on what must never happen."""
    if bad:
        return "**missed**"
    return "met" if of >= _MANY else f"none, but of fewer than {_MANY}"


def aims_table(kept: Mapping[int, Figures], of: str = "the usual reflector") -> Table:
    """Compare every aim with what was measured, of recordings of one reflector."""
    trials = [trial for trial in kept.values() if trial]
    rows = [*_pixels(trials), *_poses(trials), *_automatic(trials), *_radar(trials)]
    return Table(f"Aims, on {len(trials)} recordings of {of}", ("what", "aim", "measured", "verdict"), tuple(rows))


def _pixels(trials: Sequence[Figures]) -> list[_Row]:
    rows: list[_Row] = []
    for name, words, least in _CLICKING:
        share = _share(trials, f"{name} right", "placements")
        counts = f"{share:.1%} of {summed(trials, 'placements'):.0f} true placements"
        rows.append(
            (f"right pixel within 3 px, {words}", f"at least {least:.0%}", counts, _verdict(share, least, least=True))
        )
    for name, words, _ in _CLICKING:
        nowhere, beyond = (_share(trials, f"{name} {key}", f"{name} proposed") for key in ("nowhere", "beyond"))
        measured = f"{beyond:.1%} beyond 3 px, {nowhere:.1%} not on the reflector"
        rows.append((f"wrong proposals, {words}", "at most 20 %", measured, _verdict(beyond, 0.2)))
    for name, words, _ in _CLICKING:
        surely = _share(trials, f"{name} surely nowhere", f"{name} sure")
        rows.append((f"the same of those with a confidence of 0.9 or more, {words}", "", f"{surely:.1%}", ""))
    for name, words, _ in _CLICKING:
        covered = _share(trials, f"{name} covered", f"{name} axes")
        verdict = _verdict(abs(covered - 0.95), 0.03)
        rms = float(np.sqrt(_share(trials, f"{name} squares", f"{name} axes")))
        measured = f"{covered:.1%}; error over sigma {rms:.2f} (RMS)"
        rows.append((f"errors within 1.96 stated sigmas, {words}", "95 %", measured, verdict))
    return rows


def _poses(trials: Sequence[Figures]) -> list[_Row]:
    rows: list[_Row] = []
    for name, words, most in (
        ("without", "accepted without a click", 1.2),
        ("after", "accepted after one click", 1.05),
        ("auto", "--auto", 1.2),
    ):
        measured, worst = _ratio(trials, name)
        rows.append(
            (f"pose error over that of true clicks, {words}", f"at most {most:g}", measured, _verdict(worst, most))
        )
    return rows


def _automatic(trials: Sequence[Figures]) -> list[_Row]:
    solvable = [trial for trial in trials if trial.get("true rotation_rad") is not None and "auto refused" in trial]
    far = int(summed(trials, "true far"))
    of_true = ("the same of true clicks, for comparison", "", limit_95(far, len(trials)), "")
    if not solvable:
        return [of_true]
    refused, far = int(summed(solvable, "auto refused")), int(summed(solvable, "auto far"))
    counts = f"{refused} of {len(solvable)}"
    verdict = _verdict(refused / len(solvable), 0.15)
    return [
        ("refusals of --auto where true clicks solve", "at most 15 %", counts, verdict),
        ("confidently wrong poses of --auto", f"0 of {_MANY}", limit_95(far, len(solvable)), _none(far, len(solvable))),
        of_true,
    ]


def _radar(trials: Sequence[Figures]) -> list[_Row]:
    ends = _share(trials, "ends within", "ends")
    found = f"{_share(trials, 'found', 'placements'):.1%}, and {summed(trials, 'invented'):.0f} more"
    return [
        ("ends of dwells within 0.3 s", "at least 90 %", f"{ends:.1%}", _verdict(ends, 0.9, least=True)),
        ("true placements that the radar shows", "", found, ""),
    ]


def traits_table(kept: Mapping[int, Figures]) -> Table:
    """Tell which recordings are hard."""
    by_trait: dict[str, list[Figures]] = {"all": []}
    for seed, trial in sorted(kept.items()):
        if trial:
            for trait in ("all", *case_of(seed).traits):
                by_trait.setdefault(trait, []).append(trial)
    head = (
        "recordings",
        "number",
        "right without a click",
        "right after one",
        "not on the reflector, without",
        "after",
        "median error after one [px]",
        "pose without a click",
        "pose after one",
        "refused by --auto",
    )
    return Table(
        "By what is special about them",
        head,
        tuple((trait, *_cells(trials)) for trait, trials in by_trait.items()),
        "Poses: ratio of the RMS errors to those of true clicks, the larger one of rotation and position.",
    )


def _cells(trials: Sequence[Figures]) -> tuple[str, ...]:
    medians = [value for trial in trials if (value := trial.get("after median px")) is not None]
    return (
        str(len(trials)),
        *(f"{_share(trials, f'{name} right', 'placements'):.0%}" for name, *_ in _CLICKING),
        *(f"{_share(trials, f'{name} nowhere', f'{name} proposed'):.0%}" for name, *_ in _CLICKING),
        f"{np.median(medians):.1f}" if medians else "-",
        *(f"{_ratio(trials, name)[1]:.2f}" for name, *_ in _CLICKING),
        f"{summed(trials, 'auto refused'):.0f}" if any("auto refused" in trial for trial in trials) else "-",
    )
