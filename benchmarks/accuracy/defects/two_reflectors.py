"""Recordings with two reflectors: are the placements of both found?"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.accuracy.figures import at_least, at_most, column, fewest, share, summed_up
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from calib_core.association.placements import Placement, find_placements
from calib_core.options import GatingOptions
from calib_core.synthetic import simulate_scans
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.scene.stage import SimulatedPlacement

__all__ = ["ROWS", "measure_two", "section"]

_TRIALS = 20
_FIRST_SEED = 700
_PRESETS: tuple[PresetName, ...] = ("default", "two-reflectors", "two-reflectors-islands")
_NEAR_M, _NEAR_RAD = 0.3, np.deg2rad(4.0)  # far enough for the radar's bins and bias
_FOUND, _WRONG = 90.0, 20.0  # percent


def measure_two(preset: PresetName, trial: int) -> Figures:
    """Look for the placements in the scans of one simulated recording."""
    simulated = simulate_scans(replace(PRESETS[preset], seed=_FIRST_SEED + trial))
    found = find_placements(simulated.scans, GatingOptions())
    places = [_nearest(one, simulated.placements) for one in found]
    return {
        "placements": float(len(simulated.placements)),
        "found": float(len({true.id for true in places if true is not None})),
        "proposals": float(len(found)),
        "wrong": float(sum(true is None for true in places)),
    }


def _nearest(proposal: Placement, placements: Sequence[SimulatedPlacement]) -> SimulatedPlacement | None:
    """Return the nearest placement that a proposal can be of; a proposal is of one placement only."""
    near = [true for true in placements if _is_of(proposal, true)]
    return min(near, key=lambda true: np.linalg.norm(proposal.position_radar_m - true.position_radar_m), default=None)


def _is_of(placement: Placement, true: SimulatedPlacement) -> bool:
    """Return whether a proposal overlaps a placement in time and is at its place."""
    range_m = float(np.linalg.norm(true.position_radar_m))
    away_m = float(np.linalg.norm(placement.position_radar_m - true.position_radar_m))
    return placement.start < true.end and placement.end > true.start and away_m < _NEAR_M + _NEAR_RAD * range_m


def _key(preset: PresetName) -> str:
    return f"placements-{preset}"


ROWS = tuple(Row(_key(preset), _TRIALS, partial(measure_two, preset)) for preset in _PRESETS)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts = [], []
    for preset in _PRESETS:
        trials = kept.get(_key(preset), ())
        if not trials:
            continue
        placements, found, proposals, wrong = (
            int(column(trials, name).sum()) for name in ("placements", "found", "proposals", "wrong")
        )
        shares = (share(_flags(found, placements)), share(_flags(wrong, proposals)))
        judged = [at_least(shares[0], _FOUND), at_most(shares[1], _WRONG)]
        verdicts += judged
        what = (preset, str(len(trials)), str(placements), shares[0].percent, str(proposals), shares[1].percent)
        cells.append((*what, f"{_FOUND:g} % / {_WRONG:g} %", " / ".join(judged)))
    head = ("preset", "recordings", "placements", "found", "proposals", "wrong", "aim", "")
    aim = "two reflectors at once: 90 % of the placements found, at most one wrong proposal in five"
    claim = summed_up(aim, verdicts, fewest(kept, [row.key for row in ROWS]))
    title = "Two reflectors in one recording: are the placements found?"
    return Section(title, _TEXT, (Part("", head, tuple(cells)),), (claim,), side_by_side=True)


def _flags(count: int, total: int) -> np.ndarray:
    """Return an array with as many ones as counted."""
    return (np.arange(total) < count).astype(np.float64)


_TEXT = """Simulated recordings of the presets of `cocalib simulate`, radar only. A placement is found if it is the nearest one
that a proposal overlaps in time, within 0.3 m and 4 deg of the range; proposals without a placement are wrong."""
