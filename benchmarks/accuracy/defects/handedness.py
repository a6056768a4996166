"""Mirrored and right radars on one rig and on rigs far apart: is the one noticed, and the other left alone?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal

import numpy as np

from benchmarks.accuracy.defects.pair_defects import clicked_again, mirrored, random_rig_apart, with_zero_pair
from benchmarks.accuracy.figures import MET, MISSED
from benchmarks.accuracy.outcomes import codes_in, outcome_figures, solved_or_refused
from benchmarks.accuracy.rows import Claim, Figures, Kept, Row, Section
from benchmarks.simulated_pairs import NoiseName, draw_systematic_errors, simulate_pairs, study_camera
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions, SolvingOptions
from calib_core.synthetic.rig import Rig, random_rig

_RIGHT, _MIRRORED = 12, 20  # times fourteen and eight cases: 168 and 160
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_Kind = Literal["mirrored", "right", "thrice", "flat", "zero"]
_KINDS: tuple[_Kind, ...] = ("mirrored", "right", "thrice", "flat", "zero")
_SHOWN: dict[_Kind, str] = {
    "mirrored": "mirrored",
    "right": "right",
    "thrice": "right, three clicks of every placement",
    "flat": "right, without elevation",
    "zero": "right, one position of zero",
}
_ACCUSED, _NOTICED = ("mirrored-axes",), ("mirrored-axes", "handedness-open")


@dataclass(frozen=True, slots=True)
class Hand:
    """What is drawn: noise, placements, distance between the sensors (0: on one mast), and what is wrong.

    A radar is mirrored, or right: with one click of each placement or three, without elevation, or with one position of zero.
    """

    noise: NoiseName
    pairs: int
    apart_m: float = 0.0
    kind: _Kind = "right"

    @property
    def key(self) -> str:
        """A file name."""
        return f"hand-{self.noise}-{self.pairs}-{self.apart_m:g}m-{self.kind}"


_CASES = (
    *(
        Hand(noise, pairs, apart_m, kind)
        for kind, apart_m, noise, pairs in product(_KINDS[:2], (0.0, 8.0), _NOISES, (12, 20))
    ),
    *(Hand(noise, 12, kind=kind) for kind, noise in product(_KINDS[2:], _NOISES)),
)


def measure_hand(case: Hand, trial: int) -> Figures:
    """Solve one set; the estimator is told a distance of 8 m, and nothing of a common mast."""
    rng = np.random.default_rng([2034, case.pairs, trial])
    rig = _rig(case, rng)
    errors = replace(draw_systematic_errors(rng), measures_elevation=case.kind != "flat")
    given = simulate_pairs(case.pairs, rng=rng, noise=case.noise, rig=rig, systematic=errors)
    if case.kind == "mirrored":
        given = mirrored(given)
    elif case.kind == "thrice":
        given = clicked_again(given, 3, rng=rng)
    elif case.kind == "zero":
        given = with_zero_pair(given, rng)
    solving = SolvingOptions(nominal_camera_distance_m=case.apart_m) if case.apart_m else SolvingOptions()
    options = CalibrationOptions(solving=solving)
    outcome = solved_or_refused(lambda: calibrate_pairs(given.pairs, given.camera, options))
    return outcome_figures(outcome, given.camera_from_radar)


def _rig(case: Hand, rng: np.random.Generator) -> Rig:
    if case.apart_m:
        return random_rig_apart(rng, camera=study_camera(), distance_m=case.apart_m)
    return random_rig(rng, camera=study_camera())


ROWS = tuple(
    Row(case.key, _MIRRORED if case.kind == "mirrored" else _RIGHT, partial(measure_hand, case), draws)
    for draws, case in enumerate(_CASES)
)


def section(kept: Kept) -> Section:
    """Judge each row."""
    rows: list[dict[str, str]] = []
    flags: dict[bool, list[bool]] = {True: [], False: []}
    for case in _CASES:
        trials, turned = kept.get(case.key, ()), case.kind == "mirrored"
        if not trials:
            continue
        bad = _bad(case, trials)
        flags[turned] += bad
        codes = (*_NOTICED, "handedness-assumed")
        rows.append(
            {"radar": _SHOWN[case.kind], "noise": case.noise, "placements": str(case.pairs)}
            | {"sensors": f"{case.apart_m:g} m apart, told" if case.apart_m else "one mast, not told"}
            | {"sets": str(len(trials))}
            | {code: str(sum(code in codes_in(one) for one in trials)) for code in codes}
            | {"silent or accused": str(sum(bad)), "aim": "0", "verdict": MISSED if any(bad) else MET}
        )
    aims = {True: "mirrored radars silent: none", False: "right radars called mirrored: none"}
    claims = tuple(
        Claim(aims[turned], f"{sum(bad)} of {len(bad)} sets", MISSED if any(bad) else MET)
        for turned, bad in flags.items()
    )
    return Section("Are mirrored axes noticed?", _TEXT, claims, tuple(rows))


def _bad(case: Hand, trials: Sequence[Figures]) -> list[bool]:
    """Flag mirrored radars without a word about it, or right ones that are called mirrored."""
    if case.kind == "mirrored":
        return ["rotation_rad" in one and not codes_in(one) & set(_NOTICED) for one in trials]
    return [bool(codes_in(one) & set(_ACCUSED)) for one in trials]


_TEXT = """12 and 20 placements on flat ground, none wrong, camera position not given, with the errors that all pairs share.
Silent: neither `mirrored-axes` nor `handedness-open`."""
