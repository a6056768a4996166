"""How large a remount must be for two recordings to show it, by radar, pictures and placements.

python -m benchmarks.fleet.remount_sizes [--vehicles 8] [--seed 5]

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

from app.batch.driving import drive
from app.batch.engines.in_process import InProcess
from app.batch.job import jobs_of
from app.batch.manifest_files.reading import read_manifest
from app.batch.results_folder import ResultsFolder
from app.fleet.index import read_fleet
from benchmarks.fleet.plan import Remount, plan_fleet
from benchmarks.fleet.simulated_fleet import write_fleet
from benchmarks.fleet.simulated_session import RECORDING
from calib_core.arrays import Vector3
from calib_core.fleet import SessionPose, Transition, transition
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.synthetic import RadarName

__all__ = ["main", "remounted_pose", "unchanged_transitions"]

_SIZES = (*(Remount(float(deg), 0.0) for deg in (1, 2, 3, 4, 5, 7)), *(Remount(0.0, m) for m in (0.03, 0.05, 0.1, 0.2)))
_DIRECTIONS = 50


@dataclass(frozen=True, slots=True)
class _Sessions:
    """How sessions are recorded: which radar, pictures of which size, how many placements, and whether with a tape."""

    radar: RadarName
    width_px: int
    placements: int
    tape: bool = True


_KINDS = (
    _Sessions("imaging", 320, 10),
    _Sessions("imaging", 640, 10),
    _Sessions("imaging", 640, 24),
    _Sessions("imaging", 640, 24, tape=False),
    _Sessions("imaging", 960, 40),
    _Sessions("awr1843", 640, 24),
)


def unchanged_transitions(kind: _Sessions, vehicles: int, seed: int, folder: Path) -> list[Transition]:
    """Record and calibrate every vehicle twice, and return the transitions in between.

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
    manifest = write_fleet(folder, plan_fleet(vehicles, 2, seed, recording=recording, sound=True), InProcess())
    if not kind.tape:
        kept = [line for line in manifest.read_text(encoding="utf-8").splitlines() if "camera_position" not in line]
        manifest.write_text("\n".join(kept), encoding="utf-8")
    results = folder / "out"
    drive(jobs_of(read_manifest(manifest).rows, folder), InProcess(), ResultsFolder(results))
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
        with tempfile.TemporaryDirectory() as folder:
            steps = unchanged_transitions(kind, vehicles, seed, Path(folder))
        sigma_deg = float(np.median([step.resolved_deg for step in steps])) / 1.96 / np.sqrt(2.0)
        sigma_cm = float(np.median([step.resolved_cm for step in steps])) / 1.96 / np.sqrt(2.0)
        rng = np.random.default_rng(seed)
        named = [f"{100 * _share_named(steps, size, rng):.0f} %" for size in _SIZES]
        cells = [
            kind.radar,
            f"{kind.width_px} px",
            f"{kind.placements}",
            "1 cm" if kind.tape else "none",
            f"{sigma_deg:.2f} deg, {sigma_cm:.1f} cm",
            f"{np.mean([step.squared for step in steps]):.1f}",
            f"{sum(step.is_remount for step in steps)} of {len(steps)}",
            *named,
        ]
        yield f"| {' | '.join(cells)} |"


def main(arguments: list[str]) -> int:
    """Print a table: what share of the remounts of a size is named, about or along random axes."""
    parser = argparse.ArgumentParser(prog="benchmarks.fleet.remount_sizes", description=main.__doc__)
    parser.add_argument("--vehicles", type=int, default=8, help="for each row, with two recordings each")
    parser.add_argument("--seed", type=int, default=5)
    given = parser.parse_args(arguments)
    for line in _rows(given.vehicles, given.seed):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
