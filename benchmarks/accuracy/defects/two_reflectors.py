"""Recordings with two reflectors close together: does each click get its own reflector's return?"""

import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.accuracy.figures import at_most, column, counted, tally
from benchmarks.accuracy.rows import Figures, Kept, Row, Section
from calib_core.calibration import calibrate
from calib_core.radar import direction_cosines
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.recordings.containers.writing import write_ros1_bag
from calib_core.results import Calibration
from calib_core.synthetic.files import radar_messages
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.recording import simulate

_TRIALS = 2
_FIRST_SEED = 700
_CLOSE: tuple[PresetName, ...] = ("two-reflectors-close", "two-reflectors-azimuths")
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
    placed = zip(simulated.clicks, simulated.placements, strict=True)
    truth = {click.id: placement.position_radar_m for click, placement in placed}
    wrong = [pair for pair in outcome.pairs if not _same(pair.point_radar_m, truth[pair.id])]
    return {
        "clicks": float(len(simulated.clicks)),
        "wrong": float(len(wrong) + len(outcome.unpaired)),
        "wrong_agreeing": float(sum(pair.inlier for pair in wrong)),
        "asked": float(sum(pair.rival >= 0 and not pair.inlier for pair in outcome.pairs)),
    }


def _same(one_m: np.ndarray, other_m: np.ndarray) -> bool:
    return bool((np.abs(direction_cosines(one_m) - direction_cosines(other_m)) < _SAME).all())


def _key(preset: PresetName) -> str:
    return f"returns-{preset}"


ROWS = tuple(Row(_key(preset), _TRIALS, partial(measure_returns, preset)) for preset in _CLOSE)


def section(kept: Kept) -> Section:
    """Judge each row."""
    rows, judged = [], []
    for preset in _CLOSE:
        trials = [trial for trial in kept.get(_key(preset), ()) if trial["wrong"] is not None]
        if not trials:
            continue
        clicks, wrong, agreeing, asked = (
            int(column(trials, name).sum()) for name in ("clicks", "wrong", "wrong_agreeing", "asked")
        )
        shares = (counted(wrong, clicks), counted(agreeing, max(wrong, 1)), counted(asked, clicks))
        limits = (_WRONG_RETURNS, _WRONG_AGREEING, _ASKED)
        verdicts = [at_most(one, limit) for one, limit in zip(shares, limits, strict=True)]
        words = ("wrong", "of these agreeing", "asked")
        judged += [
            (f"{preset}, {word}", f"{one.value:.1f} %", v) for word, one, v in zip(words, shares, verdicts, strict=True)
        ]
        counts = dict(zip(words, map(str, (wrong, agreeing, asked)), strict=True))
        rows.append({"preset": preset, "recordings": str(len(trials)), "clicks": str(clicks)} | counts)
        rows[-1] |= {"aim": " / ".join(f"{limit:g} %" for limit in limits), "verdict": " / ".join(verdicts)}
    claims = (tally("1 % of the clicks with a wrong return, a fifth of these agreeing, 5 % asked", judged),)
    return Section("Two reflectors close together: does each click get its own return?", _TEXT, claims, tuple(rows))


_TEXT = """Presets of `cocalib simulate`, radar only. A return is wrong if it is not within 0.15 m, 0.04 in sine of azimuth and
0.08 in sine of elevation of the reflector that was clicked."""
