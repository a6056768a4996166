"""Pairs with the defects that were seen to make confident answers wrong: how many are silently wrong?"""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from benchmarks.accuracy.defects.adversaries import Adversary
from benchmarks.accuracy.defects.adversaries_of_pairs import ADVERSARIES_OF_PAIRS
from benchmarks.accuracy.defects.adversaries_of_scans import ADVERSARIES_OF_SCANS
from benchmarks.accuracy.figures import MET, MISSED, UNDECIDED, column, share
from benchmarks.accuracy.outcomes import codes_in, named, outcome_figures, silently_wrong
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from calib_core.results.verdict import verdict_on

__all__ = ["ALL", "ROWS", "highest_share", "measure_adversary", "section", "silent"]

_TRIALS = 300
_FEWEST_DRAWS, _HIGHEST_SHARE = 3000, 0.001
ALL: Mapping[str, Adversary] = {one.key: one for one in (*ADVERSARIES_OF_PAIRS, *ADVERSARIES_OF_SCANS)}


def measure_adversary(key: str, trial: int) -> Figures:
    """Draw one trial of a row and solve it with the default options."""
    solved = ALL[key].solve(trial)
    level = verdict_on(solved.outcome).level
    relied = {"relied on": float(level in ("good", "usable")), "contradictory": float(level == "contradictory")}
    return outcome_figures(solved.outcome, solved.truth) | relied


def _key(adversary: Adversary) -> str:
    return f"adversarial-{adversary.key}"


ROWS = tuple(Row(_key(one), _TRIALS, partial(measure_adversary, one.key)) for one in ALL.values())


def silent(adversary: Adversary, trials: Sequence[Figures]) -> np.ndarray:
    """Flag the trials that are silently wrong."""
    if adversary.trusted is None:
        relied = adversary.always_wrong or column(trials, "relied on") > 0.0
        return silently_wrong(trials, adversary.codes, always_wrong=adversary.always_wrong) & relied
    largest_deg, largest_m = adversary.trusted
    wrong = (column(trials, "rotation_rad") > np.deg2rad(largest_deg)) | (column(trials, "position_m") > largest_m)
    return wrong & ~np.array([named(figures, adversary.codes) for figures in trials], dtype=np.bool_)


def highest_share(count: int, draws: int) -> float:
    """Return the upper 95 % limit (one-sided, Clopper-Pearson) of a share, given the count in a number of draws."""
    from scipy.special import betaincinv

    return 1.0 if count >= draws else float(betaincinv(count + 1.0, draws - count, 0.95))


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, counts, lengths = [], [], []
    gauges = []
    for adversary in ALL.values():
        trials = kept.get(_key(adversary), ())
        if not trials:
            continue
        if adversary.gauge:
            gauges.append((adversary, trials))
            continue
        flags = silent(adversary, trials)
        counts.append(int(flags.sum()))
        lengths.append(len(trials))
        cells.append(_cells(adversary, trials, counts[-1]))
    head = ("finding", "trials", "silently wrong", "", "c", "warned", "no pose", "warnings in a quarter or more")
    claims = (_row_claim(counts, lengths), _overall_claim(counts, lengths), _gauge_claim(gauges))
    title = "Defects that were seen: how often is an answer silently wrong?"
    seen = Part("What no pair can show", _GAUGE_HEAD, tuple(_gauge_cells(*one) for one in gauges))
    return Section(title, _TEXT, (Part("", head, tuple(cells)), seen), claims)


_GAUGE_HEAD = ("finding", "trials", "good or usable", "contradictory", "c", "good or usable and far off")


def _gauge_cells(adversary: Adversary, trials: Sequence[Figures]) -> tuple[str, ...]:
    relied, contradictory = (column(trials, name) > 0.0 for name in ("relied on", "contradictory"))
    far = silently_wrong(trials, ()) & relied
    counts = (len(trials), int(relied.sum()), int(contradictory.sum()))
    return (adversary.finding, *map(str, counts), share(_covered(trials)).percent, str(int(far.sum())))


def _covered(trials: Sequence[Figures]) -> np.ndarray:
    squared = column(trials, "squared")
    return np.where(np.isfinite(squared), squared <= column(trials, "quantile"), np.nan)


def _gauge_claim(gauges: Sequence[tuple[Adversary, Sequence[Figures]]]) -> Claim:
    aim = "what no pair can show, with a camera position that is right to 2 cm: contradictory, or inside"
    trials = [one for adversary, several in gauges if adversary.finding.endswith("tape") for one in several]
    if not trials:
        return Claim(aim, "not run", "not run")
    met = (column(trials, "contradictory") > 0.0) | (_covered(trials) > 0.0)
    return Claim(aim, f"{int(met.sum())} of {len(met)}", MET if met.all() else MISSED)


def _cells(adversary: Adversary, trials: Sequence[Figures], count: int) -> tuple[str, ...]:
    squared, covered = column(trials, "squared"), share(_covered(trials))
    warned = np.mean([bool(codes_in(one) & set(adversary.codes)) for one in trials])
    no_pose = int(np.isnan(column(trials, "rotation_rad")).sum())
    judged = _verdict(count, len(trials))
    shown = "-" if adversary.always_wrong or not np.isfinite(squared).any() else covered.percent
    warnings = f"{warned:.0%}" if adversary.codes else "-"
    return (
        *(adversary.finding, str(len(trials)), str(count), judged, shown, warnings),
        *(str(no_pose), ", ".join(_frequent(trials))),
    )


def _frequent(trials: Sequence[Figures]) -> list[str]:
    """Return the codes in a quarter of the trials or more, sorted."""
    everything = [code for figures in trials for code in codes_in(figures)]
    return sorted(code for code in set(everything) if everything.count(code) >= 0.25 * len(trials))


def _verdict(count: int, draws: int) -> str:
    if count:
        return MISSED
    return MET if draws >= _TRIALS else UNDECIDED


def _row_claim(counts: Sequence[int], lengths: Sequence[int]) -> Claim:
    aim = "no silently wrong answer in 300 draws of any adversarial row"
    if not counts:
        return Claim(aim, "not run", "not run")
    rows = sum(count > 0 for count in counts)
    measured = f"{rows} of {len(counts)} rows have some; {min(lengths)} trials or more a row"
    return Claim(aim, measured, _verdict(rows, min(lengths)))


def _overall_claim(counts: Sequence[int], lengths: Sequence[int]) -> Claim:
    """Judge the share over all rows, with equal numbers per row."""
    aim = "silently wrong over all rows: upper 95 % limit at most 1 in 1,000"
    if not counts:
        return Claim(aim, "not run", "not run")
    total, draws = sum(counts), min(lengths) * len(lengths)
    limit = highest_share(total, sum(lengths))
    verdict = MET if limit <= _HIGHEST_SHARE and draws >= _FEWEST_DRAWS else MISSED
    if verdict == MISSED and total <= _HIGHEST_SHARE * sum(lengths):
        verdict = UNDECIDED
    return Claim(aim, f"{total} in {sum(lengths):,}; upper limit {1000.0 * limit:.2f} in 1,000", verdict)


_TEXT = """Each row draws pairs, or scans and clicks, with one defect, and solves them with the default options, the camera
position being unknown ("free") or given to 1 cm ("tape"). An answer is silently wrong if its verdict is good or usable, the
squared Mahalanobis distance of the true pose is above twice the stated 99.9 % quantile and none of the row's warnings is given;
"warned" is the share with such a warning, "-" if no warning excuses the row. The stated quantile is that of 6 F(6, nu), with
nu from the stated 95 % quantile. Where the input makes no sense (mirrored axes, positions in millimetres or
centimetres), every answer without the warning is silently wrong. With positions in feet and a measured camera
position the pose can be right all the same. Algorithm 1 states no uncertainty: its answers count above 1 deg or 25
cm. No answer is better than a wrong one, and never counts. `c` is the share whose truth lies inside the stated 95 %
ellipsoid. In the second table another pose explains the pairs as well, so that at most a measured camera position, here
right to 2 cm, can show the defect: these rows count for nothing above, and the assumption that the verdict states does not
count as naming. A sheared array, whose elevations take up a share of the azimuths, is a roll to placements on the ground; 2 deg
of it, and an image cropped after its intrinsics were measured, are a turn, which a camera position does not show either."""
