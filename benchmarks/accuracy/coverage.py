"""Does the stated 95 % ellipsoid contain the truth in 95 % of the trials?"""

from collections.abc import Sequence
from functools import partial
from itertools import product

from benchmarks.accuracy.cases import Case
from benchmarks.accuracy.efficiency import measure_ours
from benchmarks.accuracy.figures import column, fewest, joined, share, summed_up, within
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from benchmarks.accuracy.smooth import SMOOTH_COUNTS, smooth_key
from benchmarks.simulated_pairs import NoiseName

__all__ = ["ROWS", "section"]

_TRIALS = 500
_LOW, _HIGH = 93.0, 97.0
_GIVEN = {1 / 1.7: "given 1.7 times too small", 1.7: "given 1.7 times too large", 0.0: "not given"}
_NOISES: tuple[NoiseName, ...] = ("ti", "ti_fine", "imaging")
_COUNTS = (10, 20, 40)
_CASES = [Case(noise, pairs, 0.1, told=told) for told, noise, pairs in product(_GIVEN, _NOISES, _COUNTS)]
ROWS = tuple(Row(f"told-{case.key}", _TRIALS, partial(measure_ours, case)) for case in _CASES)


def section(kept: Kept) -> Section:
    """Write the tables."""
    unknown, smooth = _unknown(kept), _smooth(kept)
    verdicts = [*unknown[1], *smooth[1]]
    trials = fewest(kept, [row.key for row in ROWS])
    claim = summed_up("the 95 % ellipsoid contains the truth in 93 to 97 % of the trials", verdicts, trials)
    return Section("Is the stated uncertainty right?", _TEXT, (unknown[0], smooth[0]), (claim,))


def _unknown(kept: Kept) -> tuple[Part, list[str]]:
    cells: list[tuple[str, ...]] = []
    verdicts: list[str] = []
    for noise, pairs in product(_NOISES, _COUNTS):
        cases = [Case(noise, pairs, 0.1, told=told) for told in _GIVEN]
        _add_row(cells, verdicts, (noise, str(pairs)), [kept.get(f"told-{case.key}", ()) for case in cases])
    head = ("noise", "pairs", "trials", *(f"c, {told}" for told in _GIVEN.values()), "aim", "")
    return Part("Noise unknown; field, 10 % wrong, camera position measured", head, tuple(cells)), verdicts


def _smooth(kept: Kept) -> tuple[Part, list[str]]:
    cells: list[tuple[str, ...]] = []
    verdicts: list[str] = []
    for count in SMOOTH_COUNTS:
        _add_row(cells, verdicts, (str(count),), [kept.get(smooth_key(count), ())])
    return Part("Smooth angle error of the radar", ("pairs", "trials", "c", "aim", ""), tuple(cells)), verdicts


def _add_row(
    cells: list[tuple[str, ...]], verdicts: list[str], what: tuple[str, ...], several: list[Sequence[Figures]]
) -> None:
    """Append a row of shares and their verdicts, one per case, unless a case was not run."""
    if not all(several):
        return
    covered = [share(column(trials, "inside")) for trials in several]
    judged = [within(one, _LOW, _HIGH) for one in covered]
    verdicts += judged
    shares = (one.percent for one in covered)
    cells.append((*what, str(min(map(len, several))), *shares, "93 to 97 %", joined(judged)))


_TEXT = """`c` is the share of trials whose true pose lies inside the stated 95 % ellipsoid (six dimensions). The estimator
is given a noise level of the radar's positions that is wrong by a factor, or no noise level for radar or
clicks. In the last case it uses the defaults (2 px, 3 cm, 0.5 and 1 deg), which are four times too large for the imaging
radar. With the smooth angle error, neighbouring placements share an error of 0.3 deg in azimuth and 0.8 deg in elevation
that varies over about 14 deg."""
