"""Measure at the level of poses: `python -m benchmarks.fleet [--fleets N] [--seed N]`.

The errors of the calibrations are normal, with the covariance that they state, so that only the fleet's mathematics is tested.
"""

import argparse
from collections.abc import Iterator
from itertools import chain

import numpy as np

from benchmarks.fleet.simulated_poses import Accuracy, Spread, simulated_fleet, simulated_mounting, simulated_session
from calib_core.fleet import (
    MountingScatter,
    mounting_of,
    mounting_scatter,
    mountings_of,
    off_kind,
    off_kinds,
    transitions_of,
)
from calib_core.fleet.mountings import Mounting
from calib_core.geometry import RigidTransform

_NEW = 50
_NARROW, _WIDE = Spread(0.005, 0.3), Spread(0.05, 5.0)
_ACCURACIES = (Accuracy(0.001, 0.05), Accuracy(0.02, 0.15), Accuracy(0.07, 0.6))


def main() -> None:
    """Print the two tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fleet", description=__doc__)
    parser.add_argument(
        "--fleets",
        type=int,
        default=40,
        help="simulated fleets for each row; a quarter of it with remounts and wrong radars",
    )
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    tables = (
        named(max(1, given.fleets // 4), given.seed),
        called_off(given.fleets, given.seed),
    )
    for line in chain.from_iterable(tables):
        print(line, flush=True)


def named(fleets: int, seed: int) -> Iterator[str]:
    """Say of fleets with remounts and wrong radars what is named."""
    yield "| calibrations | remounts named | wrong radars named | false remounts | false off-kind | unchanged | cannot tell |"
    yield "|---|---|---|---|---|---|---|"
    for accuracy in _ACCURACIES:
        rng = np.random.default_rng(seed)
        right = np.zeros(2, dtype=int)
        false = np.zeros(2, dtype=int)
        of = np.zeros(4, dtype=int)
        unchanged = 0
        for _ in range(fleets):
            fleet = simulated_fleet(_NARROW, accuracy, rng)
            steps = transitions_of(fleet.sessions)
            scatter = mounting_scatter(mountings_of(fleet.sessions), vehicle_type="van")
            assert isinstance(scatter, MountingScatter)
            tested = off_kinds(scatter)
            odd = fleet.wrong | fleet.remounted
            remounts = [one.before.vehicle for one in steps if one.is_remount]
            off = [one.mounting.vehicle for one in tested if one.is_off]
            right += [len(fleet.remounted & set(remounts)), len(fleet.wrong & set(off))]
            false += [len(remounts) - len(fleet.remounted & set(remounts)), len(set(off) - odd)]
            quiet = [one for one in steps if not one.is_remount]
            unchanged += sum(one.is_unchanged for one in quiet)
            of += [len(fleet.remounted), len(fleet.wrong), len(steps) - len(fleet.remounted), len(quiet)]
        yield (
            f"| {_text(accuracy)} | {right[0]} of {of[0]} | {right[1]} of {of[1]} | {false[0]} of {of[2]} | "
            f"{false[1]} of {45 * fleets} | {unchanged} | {of[3] - unchanged} |"
        )


def called_off(fleets: int, seed: int) -> Iterator[str]:
    """Say how often a sound vehicle that is not of the fleet is called unlike its type."""
    yield ""
    yield "| vehicles | scatter | calibrations | sound vehicles called off their kind | no answer |"
    yield "|---|---|---|---|---|"
    for vehicles in (5, 10, 49):
        for spread in (_NARROW, _WIDE):
            for accuracy in _ACCURACIES:
                rng = np.random.default_rng(seed)
                called = silent = 0
                for _ in range(fleets):
                    scatter = _scatter(vehicles, spread, accuracy, rng)
                    if scatter is None:
                        silent += 1
                        continue
                    for _ in range(_NEW):
                        truth = simulated_mounting(spread, rng)
                        outcome = off_kind(_calibrated(truth, accuracy, rng, "next"), scatter)
                        called += not hasattr(outcome, "is_off") or outcome.is_off
                count = (fleets - silent) * _NEW
                yield (
                    f"| {vehicles} | {100 * spread.position_m:g} cm, {spread.rotation_deg:g} deg | {_text(accuracy)} | "
                    f"{called} of {count} | {silent} of {fleets} |"
                )


def _scatter(vehicles: int, spread: Spread, accuracy: Accuracy, rng: np.random.Generator) -> MountingScatter | None:
    """Draw a fleet without faults; None if its scatter cannot be told."""
    mountings = [_calibrated(simulated_mounting(spread, rng), accuracy, rng, f"{k:03d}") for k in range(vehicles)]
    scatter = mounting_scatter(mountings, vehicle_type="van")
    return scatter if isinstance(scatter, MountingScatter) else None


def _calibrated(truth: RigidTransform, accuracy: Accuracy, rng: np.random.Generator, name: str) -> Mounting:
    return mounting_of([simulated_session(truth, accuracy, rng, vehicle=name)])


def _text(accuracy: Accuracy) -> str:
    return f"{100 * accuracy.position_m:g} cm, {accuracy.rotation_deg:g} deg"


if __name__ == "__main__":
    main()
