"""Recordings with two reflectors: are the placements of both found, and does each click get its own reflector's return?"""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.accuracy.figures import at_least, at_most, column, fewest, share, summed_up
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from calib_core.association.placements import Placement, find_placements
from calib_core.calibration import calibrate
from calib_core.options import GatingOptions
from calib_core.radar import direction_cosines
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.recordings.containers.writing import write_ros1_bag
from calib_core.results import Calibration
from calib_core.synthetic.files import radar_messages
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.recording import simulate
from calib_core.synthetic.scene.stage import SimulatedPlacement

__all__ = ["RETURN_ROWS", "ROWS", "measure_returns", "measure_two", "returns_section", "section"]

_TRIALS = 20
_FIRST_SEED = 700
_PRESETS: tuple[PresetName, ...] = ("default", "two-reflectors", "two-reflectors-islands")
_NEAR_M, _NEAR_RAD = 0.3, np.deg2rad(4.0)  # far enough for the radar's bins and bias
_FOUND, _WRONG = 90.0, 20.0  # percent


def measure_two(preset: PresetName, trial: int) -> Figures:
    """Look for the placements in the scans of one simulated recording."""
    simulated = simulate(replace(PRESETS[preset], seed=_FIRST_SEED + trial))
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
    return Section(title, _TEXT, (Part("", head, tuple(cells)),), (claim,))


def _flags(count: int, total: int) -> np.ndarray:
    """Return an array with as many ones as counted."""
    return (np.arange(total) < count).astype(np.float64)


_TEXT = """Simulated recordings of the presets of `cocalib simulate`, radar only. A placement is found if it is the nearest one
that a proposal overlaps in time, within 0.3 m and 4 deg of the range; proposals without a placement are wrong."""


_CLOSE: tuple[PresetName, ...] = ("two-reflectors-close", "two-reflectors-azimuths", "two-reflectors-topics")
_SAME = np.array([0.15, 0.04, 0.08])  # in range [m], u and w: bins and biases, far from the other reflector at 0.7 m
_WRONG_RETURNS, _WRONG_AGREEING, _ASKED = 1.0, 20.0, 5.0  # percent


def measure_returns(preset: PresetName, trial: int) -> Figures:
    """Write one simulated recording, open it with default options, and solve its clicks."""
    simulated = simulate(replace(PRESETS[preset], seed=_FIRST_SEED + trial))
    with tempfile.TemporaryDirectory() as folder:
        path = write_ros1_bag(Path(folder) / "radar.bag", radar_messages(simulated, 1))
        with open_recording(path, RecordingOptions(), require=("radar",)) as recording:
            scans = recording.radar_scans()
    outcome = calibrate(simulated.clicks, scans, simulated.camera)
    if not isinstance(outcome, Calibration):
        return {"clicks": float(len(simulated.clicks)), "wrong": None, "wrong_agreeing": None, "asked": None}
    placement_of = {one.click.id: one.placement_id for one in simulated.clicked}
    truth = {placement.id: placement.position_radar_m for placement in simulated.placements}
    wrong = [pair for pair in outcome.pairs if not _same(pair.point_radar_m, truth[placement_of[pair.id]])]
    return {
        "clicks": float(len(simulated.clicks)),
        "wrong": float(len(wrong) + len(outcome.unpaired)),
        "wrong_agreeing": float(sum(pair.inlier for pair in wrong)),
        "asked": float(sum(pair.rival >= 0 and not pair.inlier for pair in outcome.pairs)),
    }


def _same(one_m: np.ndarray, other_m: np.ndarray) -> bool:
    return bool((np.abs(direction_cosines(one_m) - direction_cosines(other_m)) < _SAME).all())


def _returns_key(preset: PresetName) -> str:
    return f"returns-{preset}"


RETURN_ROWS = tuple(Row(_returns_key(preset), _TRIALS, partial(measure_returns, preset)) for preset in _CLOSE)


def returns_section(kept: Kept) -> Section:
    """Write the table of returns."""
    cells, verdicts = [], []
    for preset in _CLOSE:
        trials = [trial for trial in kept.get(_returns_key(preset), ()) if trial["wrong"] is not None]
        if not trials:
            continue
        clicks, wrong, agreeing, asked = (
            int(column(trials, name).sum()) for name in ("clicks", "wrong", "wrong_agreeing", "asked")
        )
        shares = (share(_flags(wrong, clicks)), share(_flags(agreeing, max(wrong, 1))), share(_flags(asked, clicks)))
        limits = (_WRONG_RETURNS, _WRONG_AGREEING, _ASKED)
        judged = [at_most(one, limit) for one, limit in zip(shares, limits, strict=True)]
        verdicts += judged
        counts = (str(wrong), str(agreeing), str(asked))
        cells.append((preset, str(len(trials)), str(clicks), *counts, shares[0].percent, " / ".join(judged)))
    head = ("preset", "recordings", "clicks", "wrong", "wrong that agree", "asked", "wrong share", "")
    aim = "two reflectors 0.7 m apart in range: 1 % of the clicks with a wrong return, a fifth of these agreeing, 5 % asked"
    claim = summed_up(aim, verdicts, fewest(kept, [row.key for row in RETURN_ROWS]))
    title = "Two reflectors close together: does each click get its own return?"
    return Section(title, _RETURNS_TEXT, (Part("", head, tuple(cells)),), (claim,))


_RETURNS_TEXT = """Simulated recordings of the presets of `cocalib simulate`, radar only, opened and solved with default options.
A return is wrong if it is not within 0.15 m, 0.04 in sine of azimuth and 0.08 in sine of elevation of the reflector that was
clicked. A click that two returns fit alike asks for one of them, and does not agree until then."""
