"""How large a remount must be for two recordings to show it, by radar, pictures and placements.

python -m benchmarks.fleet.remount_sizes [--vehicles 4] [--seed 5]

Each vehicle is recorded twice without a change, with the errors that the solver assumes of radar, lens, tape and whoever clicks,
and calibrated as a batch does it. A remount is then added to the second pose, in many directions, and tested by the product.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.fleet.plan import Remount, plan_fleet
from benchmarks.fleet.simulated_fleet import write_fleet
from benchmarks.fleet.simulated_session import RECORDING
from calib_core.arrays import Vector3
from calib_core.fleet import SessionPose, Transition, transition
from calib_core.geometry import RigidTransform, camera_position_jacobian, rotation_exp
from calib_core.synthetic import RadarName
from cocalib.batch.driving import drive
from cocalib.batch.engine import InProcess
from cocalib.batch.job import jobs_of
from cocalib.batch.manifest import read_manifest
from cocalib.batch.results_folder import ResultsFolder
from cocalib.fleet.reading import read_fleet

__all__ = ["main", "recorded", "remounted_pose", "unchanged_transitions"]

_SIZES = (*(Remount(float(deg), 0.0) for deg in (1, 2, 3, 4, 5, 7)), *(Remount(0.0, m) for m in (0.03, 0.05, 0.1, 0.2)))
_DIRECTIONS = 50


@dataclass(frozen=True, slots=True)
class _Recordings:
    """Which radar, pictures of which width, and how many placements."""

    radar: RadarName
    width_px: int
    placements: int


_KINDS = (
    _Recordings("imaging", 320, 10),
    _Recordings("imaging", 640, 10),
    _Recordings("imaging", 640, 24),
    _Recordings("imaging", 640, 40),
    _Recordings("awr1843", 640, 24),
)


def recorded(kind: _Recordings, vehicles: int, seed: int, folder: Path) -> Path:
    """Record every vehicle twice, and return the manifest.

    Args:
        kind: how.
        vehicles: how many.
        seed: of the random generator.
        folder: new or empty, for the recordings.
    """
    height_px = kind.width_px * 5 // 8
    recording = replace(
        RECORDING, radar=kind.radar, width_px=kind.width_px, height_px=height_px, placements=kind.placements
    )
    return write_fleet(folder, plan_fleet(vehicles, 2, seed, recording=recording, sound=True), InProcess())


def unchanged_transitions(manifest: Path, results: Path, *, tape: bool) -> list[Transition]:
    """Calibrate both recordings of every vehicle, and return the transitions in between.

    Args:
        manifest: of a fleet in which nothing was changed.
        results: new or empty.
        tape: use the camera positions that were measured.
    """
    rows = read_manifest(manifest).rows
    if not tape:
        rows = tuple(
            replace(row, options=replace(row.options, solving=replace(row.options.solving, camera_position=None)))
            for row in rows
        )
    drive(jobs_of(rows, manifest.parent), InProcess(), ResultsFolder(results))
    return [step for vehicle in read_fleet(results).vehicles for step in vehicle.transitions]


def remounted_pose(session: SessionPose, turned_deg: Vector3, moved_m: Vector3) -> SessionPose:
    """Return a session whose camera was turned and moved, its error and covariance as they were.

    Args:
        session: before.
        turned_deg: (3,) rotation vector in the camera frame [deg].
        moved_m: (3,) in the radar frame [m].
    """
    pose = session.camera_from_radar
    rotation = rotation_exp(np.deg2rad(turned_deg)) @ pose.rotation
    position_m = pose.inverse().translation_m + moved_m
    return replace(session, camera_from_radar=RigidTransform(rotation, -rotation @ position_m))


def _share_named(steps: list[Transition], size: Remount, rng: np.random.Generator) -> float:
    named = 0
    for step in steps:
        for direction in rng.standard_normal((_DIRECTIONS, 3)):
            unit = direction / np.linalg.norm(direction)
            named += transition(step.before, remounted_pose(step.after, size.deg * unit, size.m * unit)).is_remount
    return named / (len(steps) * _DIRECTIONS)


def _rows(vehicles: int, seed: int) -> Iterator[str]:
    sizes = [f"{one.deg:g} deg" if one.deg else f"{100 * one.m:g} cm" for one in _SIZES]
    head = ["radar", "pictures", "placements", "tape", "sigma", "squared", "false", *sizes]
    yield f"| {' | '.join(head)} |"
    yield "|" + "---|" * len(head)
    for kind in _KINDS:
        with tempfile.TemporaryDirectory() as name:
            manifest = recorded(kind, vehicles, seed, Path(name))
            for tape in (True, False):
                steps = unchanged_transitions(manifest, Path(name) / f"tape-{tape}", tape=tape)
                cells = [
                    kind.radar,
                    f"{kind.width_px} px",
                    f"{kind.placements}",
                    "1 cm" if tape else "none",
                    *_figures(steps, np.random.default_rng(seed)),
                ]
                yield f"| {' | '.join(cells)} |"


def _figures(steps: list[Transition], rng: np.random.Generator) -> list[str]:
    largest = [np.sqrt(np.linalg.eigvalsh(one.covariance[3:, 3:])[-1]) for step in steps for one in _both(step)]
    position = [
        np.sqrt(np.linalg.eigvalsh(jacobian @ one.covariance @ jacobian.T)[-1])
        for step in steps
        for one in _both(step)
        for jacobian in (camera_position_jacobian(one.camera_from_radar),)
    ]
    return [
        f"{np.degrees(np.median(largest)):.2f} deg, {100.0 * np.median(position):.1f} cm",
        f"{np.mean([step.squared for step in steps]):.1f}",
        f"{sum(step.is_remount for step in steps)} of {len(steps)}",
        *(f"{100 * _share_named(steps, size, rng):.0f} %" for size in _SIZES),
    ]


def _both(step: Transition) -> tuple[SessionPose, SessionPose]:
    return step.before, step.after


def main(arguments: list[str]) -> int:
    """Print a table: what share of the remounts of a size is named, about or along random axes."""
    parser = argparse.ArgumentParser(prog="benchmarks.fleet.remount_sizes", description=main.__doc__)
    parser.add_argument("--vehicles", type=int, default=4, help="for each row, with two recordings each")
    parser.add_argument("--seed", type=int, default=5)
    given = parser.parse_args(arguments)
    for line in _rows(given.vehicles, given.seed):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
