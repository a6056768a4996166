"""Pairs with the defects that were seen to make confident answers wrong: how many are silently wrong?"""

import re
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from benchmarks.accuracy.defects.adversaries import Adversary
from benchmarks.accuracy.defects.adversaries_of_pairs import ADVERSARIES_OF_PAIRS
from benchmarks.accuracy.defects.adversaries_of_scans import ADVERSARIES_OF_SCANS
from benchmarks.accuracy.figures import MET, MISSED, UNDECIDED, column, low, share
from benchmarks.accuracy.outcomes import (
    LEVELS,
    codes_in,
    inside,
    level_counts,
    misleading,
    named,
    outcome_figures,
    silently_wrong,
    sold,
)
from benchmarks.accuracy.rows import Claim, Figures, Kept, Row, Section

_TRIALS, _GAUGE_TRIALS, _SESSIONS = 24, 12, 4
_HIGHEST_SHARE = 0.001
_DRAWN = re.compile(r", (ti|imaging|awr)\w*, \d+, .*")
"""What a finding says of radar, pairs and camera position."""
_CONTRADICTORY = LEVELS.index("contradictory")
ALL: Mapping[str, Adversary] = {one.key: one for one in (*ADVERSARIES_OF_PAIRS, *ADVERSARIES_OF_SCANS)}


def measure_adversary(key: str, trial: int) -> Figures:
    """Draw one trial of a row and solve it with the default options."""
    solved = ALL[key].solve(trial)
    return outcome_figures(solved.outcome, solved.truth)


def _key(adversary: Adversary) -> str:
    return f"adversarial-{adversary.key}"


def _wanted(adversary: Adversary) -> int:
    if adversary.key == "heavy-aisle":  # whole recordings
        return _SESSIONS
    return _GAUGE_TRIALS if adversary.gauge else _TRIALS


ROWS = tuple(Row(_key(one), _wanted(one), partial(measure_adversary, one.key)) for one in ALL.values())


def silent(adversary: Adversary, trials: Sequence[Figures]) -> np.ndarray:
    """Flag the trials that are silently wrong."""
    if adversary.trusted is None:
        relied = adversary.always_wrong or sold(trials)
        return silently_wrong(trials, adversary.codes, always_wrong=adversary.always_wrong) & relied
    largest_deg, largest_m = adversary.trusted
    wrong = (column(trials, "rotation_rad") > np.deg2rad(largest_deg)) | (column(trials, "position_m") > largest_m)
    return wrong & ~np.array([named(figures, adversary.codes) for figures in trials], dtype=np.bool_)


def highest_share(count: int, draws: int) -> float:
    """Return the upper 95 % limit (one-sided, Clopper-Pearson) of a share, given the count in a number of draws."""
    from scipy.special import betaincinv

    return 1.0 if count >= draws else float(betaincinv(count + 1.0, draws - count, 0.95))


def section(kept: Kept) -> Section:
    """Judge each row: by today's definition of a silent answer, and by the stated bound."""
    rows, outside = [], dict[str, list[float]]()
    judged = [(one, kept[_key(one)]) for one in ALL.values() if kept.get(_key(one))]
    for adversary, trials in judged:
        held = share(inside(trials))
        finding = _DRAWN.sub("", adversary.finding)
        if low(held) and not adversary.always_wrong:
            outside.setdefault(finding, []).append(held.value)
        warned = np.mean([bool(codes_in(one) & set(adversary.codes)) for one in trials])
        count = int(silent(adversary, trials).sum())
        rows.append(
            {
                "finding": adversary.finding,
                "no pair can show it": "yes" if adversary.gauge else "",
                "sets": str(len(trials)),
            }
            | level_counts(trials)
            | {
                "inside 95 %": "-" if adversary.always_wrong else held.percent,
                "warned": f"{warned:.0%}" if adversary.codes else "-",
                "silent": str(count),
                "misleading": str(_misleading(adversary, trials)),
                "aim silent": "0",
                "verdict": MISSED if count else MET if len(trials) >= _wanted(adversary) else UNDECIDED,
                "warnings in a quarter or more": " ".join(_frequent(trials)),
            }
        )
    seen = [one for one in judged if not one[0].gauge]
    gauges = [one for one in judged if one[0].gauge]
    claims = (*_silent_claims(seen), _gauge_claim(gauges), _cost_claim(gauges))
    title = "Defects that were seen: how often is an answer silently wrong?"
    return Section(title, _TEXT, claims, tuple(rows), tuple(_ranges(outside)))


def _misleading(adversary: Adversary, trials: Sequence[Figures]) -> int:
    return int(misleading(trials, adversary.codes, always_wrong=adversary.always_wrong).sum())


def _ranges(outside: Mapping[str, Sequence[float]]) -> list[str]:
    """Write the lowest and highest share inside of each finding."""
    ends = {finding: (f"{min(shares):.0f}", f"{max(shares):.0f}") for finding, shares in outside.items()}
    return [f"{finding} ({' to '.join(dict.fromkeys(pair))} %)" for finding, pair in ends.items()]


_Judged = Sequence[tuple[Adversary, Sequence[Figures]]]


def _silent_claims(judged: _Judged) -> tuple[Claim, ...]:
    draws = sum(len(trials) for _, trials in judged)
    if not draws:
        return ()
    counts = {one.finding: int(silent(one, trials).sum()) for one, trials in judged}
    bound = {one.finding: _misleading(one, trials) for one, trials in judged}
    total, limit = sum(counts.values()), highest_share(sum(counts.values()), draws)
    verdict = MISSED if total > _HIGHEST_SHARE * draws else MET if limit <= _HIGHEST_SHARE else UNDECIDED
    return (
        Claim(
            "silent: in none of the rows",
            f"{total} of {draws:,} sets{_named(counts)}; upper limit {1000.0 * limit:.1f} in 1,000",
            MISSED if total else MET,
        ),
        Claim("silent: at most 1 in 1,000", f"upper limit {1000.0 * limit:.1f}", verdict),
        Claim(
            "misleading: at most 1 in 1,000",
            f"{sum(bound.values())} of {draws:,} sets{_named(bound)}",
            MISSED if sum(bound.values()) > _HIGHEST_SHARE * draws else verdict,
        ),
    )


def _named(counts: Mapping[str, int]) -> str:
    return "".join(f"; {finding}: {count}" for finding, count in counts.items() if count)


def _gauge_claim(gauges: _Judged) -> Claim:
    aim = "what no pair can show, camera position right to 2 cm: contradictory, or inside"
    trials = [one for adversary, several in gauges if adversary.finding.endswith("tape") for one in several]
    met = np.array([one["level"] == _CONTRADICTORY for one in trials], dtype=np.bool_) | (inside(trials) > 0.0)
    return Claim(aim, f"{int(met.sum())} of {len(met)}", MET if met.all() else MISSED)


def _cost_claim(gauges: _Judged) -> Claim:
    """Count what another pose explains as well; the assumption that the verdict states does not count as naming."""
    everything = [one for _, trials in gauges for one in trials]
    silent_count = sum(int((silently_wrong(trials, one.codes) & sold(trials)).sum()) for one, trials in gauges)
    count = sum(_misleading(one, trials) for one, trials in gauges)
    measured = f"{silent_count} silent, {count} misleading, of {len(everything)}"
    return Claim("what no pair can show: none silent (no estimator can)", measured, MISSED if silent_count else MET)


def _frequent(trials: Sequence[Figures]) -> list[str]:
    """Return the codes in a quarter of the trials or more, sorted."""
    everything = [code for figures in trials for code in codes_in(figures)]
    return sorted(code for code in set(everything) if everything.count(code) >= 0.25 * len(trials))


_TEXT = """Each row has one defect, solved with the default options. *Silent*: the verdict is good or usable, the squared
Mahalanobis distance of the true pose is above twice the stated 99.9 % quantile, and no warning names the cause. *Misleading*,
of any verdict: above the stated 99.9 % quantile itself, and no warning names the cause. Where the input makes no sense
(mirrored axes, millimeters), every answer without the warning counts as both; Algorithm 1 states no bound, and is silent above
1 deg or 25 cm. What no pair can show is another pose that explains the pairs as well; it is counted apart."""
