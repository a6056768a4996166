"""Traffic as a witness: is its interval honest, how soon does it show a turn, how often does it say so when nothing turned?

Each recording is watched in three parts of equal length, each against a baseline of the other two. A turn is planted from a
minute after a part begins, by moving each row by what the turn does to it.
"""

import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from benchmarks.watch.rows import simulated_rows
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.radar import RadarErrors
from calib_core.watching.baseline import BASELINE_SCHEMA, Baseline
from calib_core.watching.traffic import TrafficModel, TrafficRows, Watched, learned
from calib_core.watching.watching import Stretch, Watch
from calib_core.watching.witnesses import SeenTurn

__all__ = ["KINDS", "TURNS", "Judged", "judged", "report"]

KINDS = (
    *("people/awr1843", "people/imaging", "cars-near/imaging", "robot/imaging", "people/awr1843", "cars-far/imaging"),
    *("people/imaging", "cars-near/awr1843", "people/awr1843", "cars-near/imaging", "robot/awr1843", "people/imaging"),
    "cars-far/imaging",
)
"""Thirteen recordings: people, near and far cars, a robot."""
TURNS = (("pitch", 0, 0.5), ("pitch", 0, 1.0), ("yaw", 1, 0.5), ("yaw", 1, 1.0), ("roll", 2, 2.0))
SIZED = (("pitch", 0, 1.0), ("yaw", 1, 1.0))
_AXES = ("pitch", "yaw", "roll")
_FIRST_SEED = 2000  # of the first kind
_PARTS = 3
_WINDOWS_S = (6, 12, 24, 48)
_SIGMAS = 5.0
_STEP_S = 2
_TURNS_AT_S = 60
_SEEN_FOR_S = 180
_STRETCH_S = 30
_NINETY_FIVE = 1.96
_WATCHED = Watched(RigidTransform(np.eye(3), np.zeros(3)), Camera("pinhole", 1, 1, np.eye(3)), RadarErrors())


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A recording of one kind of traffic.

    Attributes:
        kind: of traffic, and radar.
        hours: watched.
        passages: of its baselines, on the mean.
        z: by window [s], and 0 for a whole part: (n, 3) of turns where nothing turned, in windows that share no second.
        alarms: parts of a watch in which something is seen where nothing turned.
        seconds: after how many seconds each of the turns is seen, in each part (parts, turns); infinity for never.
        size_z: (parts, turns, 3) error of the stated turn over its standard deviation, three minutes after it.
    """

    kind: str
    hours: float
    passages: float
    z: dict[int, np.ndarray]
    alarms: int
    seconds: np.ndarray
    size_z: np.ndarray


def judged(kind: str, seed: int, seconds: int, folder: Path | None, rendered: bool) -> Judged:
    """Simulate a recording, or read its rows from a folder, and watch it."""
    watches = _parts(simulated_rows(kind, seed, seconds, folder, rendered=rendered), seconds)
    z = {window: np.concatenate([one.z(window) for one in watches]) for window in (*_WINDOWS_S, 0)}
    passages = float(np.mean([sum(one.model.passages) for one in watches]))
    seen = np.array([[one.seen_after(axis, turn_deg) for _, axis, turn_deg in TURNS] for one in watches])
    sizes = np.array([[one.size_z(axis, turn_deg) for _, axis, turn_deg in SIZED] for one in watches])
    return Judged(kind, seconds / 3600.0, passages, z, sum(one.alarms() for one in watches), seen, sizes)


def resampled(kind: str, seed: int, seconds: int, folder: Path | None, hours: float) -> tuple[int, int, float]:
    """Draw whole passages where nothing turned; return the alarms, how many distinct passages there are, and the largest z.

    A window has as many passages as one of the recording, drawn from all in the same third, none twice: of each, what one
    window saw of it. Windows do not overlap.
    """
    rng = np.random.default_rng([seed, 7])
    alarms, distinct, largest = 0, 0, 0.0
    for part in _parts(simulated_rows(kind, seed, seconds, folder), seconds):
        distinct += len(np.unique(part.rows.passages))
        for window in _WINDOWS_S:
            pieces, counts = part.pieces(window)
            for _ in range(round(hours * 3600.0 / _PARTS / window)):
                drawn = rng.choice(len(pieces), counts[rng.integers(len(counts))], replace=False)
                rows = [passage[rng.integers(len(passage))] for passage in (pieces[one] for one in drawn)]
                turn = part.model.turn(TrafficRows.joined(rows)) if rows else None
                z = 0.0 if turn is None else float(turn.least_z.max())
                largest = max(largest, z)
                alarms += z > _SIGMAS
    return alarms, distinct, largest


def _parts(rows: TrafficRows, seconds: int) -> "list[_Part]":
    length_ns = seconds * NS_PER_S // _PARTS
    start = int(rows.times_ns.min())
    part = np.minimum((rows.times_ns - start) // length_ns, _PARTS - 1)
    return [
        _Part(learned(rows.some(part != one)), rows.some(part == one), start + one * length_ns, seconds // _PARTS)
        for one in range(_PARTS)
    ]


class _Part:
    """A part of a recording that is watched with a baseline of the others."""

    def __init__(self, model: TrafficModel, rows: TrafficRows, start: int, seconds: int) -> None:
        self.model = model
        self.rows = rows
        self._start = start
        self._seconds = seconds

    def _between(self, rows: TrafficRows, first_s: float, end_s: float) -> TrafficRows:
        times_s = (rows.times_ns - self._start) / NS_PER_S
        return rows.some((times_s >= first_s) & (times_s < end_s))

    def pieces(self, window_s: int) -> tuple[list[list[TrafficRows]], np.ndarray]:
        """Return each passage, cut at the ends of windows that share no second, and how many passages each window has."""
        window = (self.rows.times_ns - self._start) // (window_s * NS_PER_S)
        keys, own = np.unique(np.stack([self.rows.passages, window], axis=1), axis=0, return_inverse=True)
        pieces: dict[int, list[TrafficRows]] = {}
        for one, passage in enumerate(keys[:, 0].tolist()):
            pieces.setdefault(passage, []).append(self.rows.some(own.reshape(-1) == one))
        return [*pieces.values()], np.bincount(keys[:, 1], minlength=self._seconds // window_s)

    def z(self, window_s: int) -> np.ndarray:
        """Return (n, 3) turns over their standard deviations, in windows that share no second; 0 for all in one."""
        found = []
        for end in range(window_s or self._seconds, self._seconds + 1, window_s or self._seconds):
            own = self._between(self.rows, end - (window_s or self._seconds), end)
            turn = self.model.turn(own) if len(own) else None
            if turn is not None and turn.passages >= 3:
                found.append(turn.rotation_rad / np.sqrt(np.diag(turn.covariance_rad2)))
        return np.array(found).reshape(-1, 3)

    def alarms(self) -> int:
        """Return how many stretches show a turn for the first time, where nothing turned."""
        seen = [np.zeros(3, dtype=np.bool_), *(traffic.turned for traffic in self._watched(self.rows))]
        return sum(bool((after & ~before).any()) for before, after in pairwise(seen))

    def _turned(self, axis: int, turn_deg: float) -> TrafficRows:
        moved = self.rows.design[:, axis] * np.deg2rad(turn_deg)
        since = self.rows.times_ns >= self._start + _TURNS_AT_S * NS_PER_S
        return replace(self.rows, residuals_rad=self.rows.residuals_rad + np.where(since, moved, 0.0))

    def seen_after(self, axis: int, turn_deg: float) -> float:
        """Return after how many seconds a turn about an axis is seen; infinity for never in three minutes."""
        rows = self._turned(axis, turn_deg)
        for end in range(_TURNS_AT_S + _STEP_S, min(_TURNS_AT_S + _SEEN_FOR_S, self._seconds) + 1, _STEP_S):
            for window in _WINDOWS_S:
                own = self._between(rows, end - window, end)
                turn = self.model.turn(own) if len(own) else None
                if turn is not None and turn.least_z[axis] > _SIGMAS:
                    return float(end - _TURNS_AT_S)
        return float("inf")

    def size_z(self, axis: int, turn_deg: float) -> np.ndarray:
        """Return by how much the stated turn is off three minutes after it, over its standard deviation (3,)."""
        rows = self._between(self._turned(axis, turn_deg), 0, _TURNS_AT_S + _SEEN_FOR_S)
        *_, seen = self._watched(rows)
        true = np.deg2rad(turn_deg) * np.eye(3)[axis] * bool(seen.turned.any())
        return np.asarray((seen.rotation_rad - true) / seen.sigma_rad)

    def _watched(self, rows: TrafficRows) -> Iterator[SeenTurn]:
        """Yield what a watch says after each half minute."""
        baseline = Baseline(BASELINE_SCHEMA, "0" * 64, "simulated", TimeNs(0), TimeNs(1), (1, 1), traffic=self.model)
        watch = Watch(baseline, _WATCHED)
        for first in range(0, self._seconds, _STRETCH_S):
            own = self._between(rows, first, first + _STRETCH_S)
            times = (TimeNs(self._start + one * NS_PER_S) for one in (first, first + _STRETCH_S))
            verdict = watch.add(Stretch(*times, None, RadarScans(), own, still=False))
            if verdict.traffic is not None:
                yield verdict.traffic


def report(
    seed: int,
    seconds: int,
    count: int,
    folder: Path | None,
    processes: int,
    *,
    resampled_hours: float,
    rendered: bool,
) -> Iterator[str]:
    """Yield what is found in a number of recordings, each with a seed of its own, and in hours of passages drawn from them."""
    kinds = [KINDS[(number - _FIRST_SEED) % len(KINDS)] for number in range(seed, seed + count)]
    found: list[Judged] = []
    given = kinds, range(seed, seed + count), [seconds] * count, [folder] * count
    if resampled_hours:
        with ProcessPoolExecutor(processes) as pool:
            drawn = [*pool.map(resampled, *given, [resampled_hours / count] * count)]
        alarms, distinct, _ = (sum(column) for column in zip(*drawn, strict=True))
        largest = max(z for _, _, z in drawn)
        yield f"{resampled_hours:g} h of {distinct} passages, drawn again and again: {alarms:.0f} alarms, largest z {largest:.1f}"
        return
    with ProcessPoolExecutor(processes) as pool:
        for one in pool.map(judged, *given, [rendered] * count):
            found.append(one)
            print(f"{len(found)} of {count}: {one.kind}, {one.alarms} alarms", file=sys.stderr, flush=True)
    yield f"{count} recordings of {seconds} s, each third watched with a baseline of the others ({seconds * 2 // 3} s)"
    yield from _interval_lines(found)
    yield from _detection_lines(found)
    hours, alarms = sum(one.hours for one in found), sum(one.alarms for one in found)
    bound = chi2.ppf(0.95, 2 * alarms + 2) / 2.0 / hours
    yield f"nothing turned: {alarms} alarms in {hours:.1f} h: fewer than {bound:.2g} an hour (95 %)"


def _interval_lines(found: Sequence[Judged]) -> Iterator[str]:
    """Yield the scatter of turns over their standard deviations, by kind of traffic and window."""
    yield "| traffic | window | rms of pitch, yaw, roll over sigma | windows |"
    yield "|---|---|---|---|"
    for kind in (*sorted({one.kind for one in found}), "all"):
        own = [one for one in found if kind in (one.kind, "all")]
        for window in (*_WINDOWS_S, 0):
            z = np.concatenate([one.z[window] for one in own])
            if not len(z):
                continue
            cells = ", ".join(f"{value:.2f}" for value in np.sqrt((z**2).mean(axis=0)))
            yield f"| {kind} | {f'{window} s' if window else 'a third'} | {cells} | {len(z)} |"
    for number, (name, axis, turn_deg) in enumerate(SIZED):
        inside = np.array([np.abs(one.size_z[:, number, axis]) < _NINETY_FIVE for one in found])
        yield f"95 % interval of {turn_deg:g} deg of {name} after three minutes: holds in {_share(inside)}"
    inside = np.array([np.abs(one.size_z).reshape(-1, 3) < _NINETY_FIVE for one in found])
    for axis, name in enumerate(_AXES):
        yield f"95 % interval of {name} after three minutes: holds in {_share(inside[..., axis])}"


def _share(inside: np.ndarray) -> str:
    return f"{100.0 * inside.mean():.1f} % of {inside.size}"


def _detection_lines(found: Sequence[Judged]) -> Iterator[str]:
    for kind in (*sorted({one.kind for one in found}), "all"):
        times = np.concatenate([one.seconds for one in found if kind in (one.kind, "all")])
        for (name, _, size), own in zip(TURNS, times.T, strict=True):
            seen = f"{np.isfinite(own).sum()} of {len(own)}"
            yield f"{kind}: {size:g} deg of {name}: seen in {seen}, median {np.median(own):.0f} s"
