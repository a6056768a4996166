"""`python -m benchmarks.targets`: Acc by labels and by the radar's own targets, on seeds from the commit's hash."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.accuracy.fresh_seeds import fresh_seeds
from benchmarks.targets.cases import CASES
from calib_core.errors import InputError, OptionError
from calib_core.evaluation.box_acc import judged_by_boxes
from calib_core.evaluation.counted_returns import CountedReturns, counted_returns
from calib_core.evaluation.target_tracking import find_targets
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.synthetic.annotations import true_boxes, true_labels
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate

__all__ = ["main"]

_FOLDER = Path(__file__).resolve().parents[2] / "build" / "targets"
_PITCH = rotation_exp(np.deg2rad(10.0) * np.array([1.0, 0.0, 0.0]))


@dataclass(frozen=True, slots=True)
class _Draw:
    """What one recording shows; shares are 0 to 1, NaN where nothing moves.

    Attributes:
        by_labels: Acc of the true pose, the truth deciding whose returns are whose.
        by_targets: the same by the radar's own targets.
        found: share of the sightings (a target in a frame) by labels of which at least one return counts by own targets.
        foreign: share of the returns that count by own targets and belong to nothing that moves.
        yawed: Acc by own targets, turned by 10 deg in yaw to both sides.
        pitched: the same, turned by 10 deg in pitch.
    """

    by_labels: float
    by_targets: float
    found: float
    foreign: float
    yawed: float
    pitched: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the cases and print a row for each recording; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.targets", description=__doc__)
    parser.add_argument("--draws", type=int, default=2, help="recordings of each case")
    parser.add_argument("--first", type=int, help="first seed; by default from the hash of the present commit")
    parser.add_argument("--cases", default="", help="only cases whose name contains this")
    parser.add_argument("--seconds", type=float, default=30.0, help="length of a recording of traffic")
    given = parser.parse_args(arguments)
    first = fresh_seeds(_FOLDER).first_trial if given.first is None else given.first
    print(f"first seed {first}\n\n| recording | by labels | by targets | difference | found | foreign | yaw | pitch |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for name, options in CASES.items():
        if given.cases not in name:
            continue
        traffic = replace(options.traffic, duration_s=given.seconds)
        for seed in range(first, first + given.draws):
            try:
                draw = _measure(replace(options, seed=seed, traffic=traffic))
            except (InputError, OptionError) as error:
                print(f"| {name} | {error} |", flush=True)
                continue
            values = (draw.by_labels, draw.by_targets, draw.by_targets - draw.by_labels, draw.found)
            values = (*values, draw.foreign, draw.yawed, draw.pitched)
            print(f"| {name} | " + " | ".join(f"{100 * value:.1f}" for value in values) + " |", flush=True)
    return 0


def _measure(options: SimulationOptions) -> _Draw:
    recording = simulate(options)
    scans, boxes, camera = recording.scans, true_boxes(recording), recording.camera
    truth = counted_returns(camera, scans, boxes, true_labels(recording))
    own = counted_returns(camera, scans, boxes, find_targets([scans]).tracks)
    pose = recording.camera_from_radar
    by_targets = judged_by_boxes(pose, camera, own)
    return _Draw(
        _share(judged_by_boxes(pose, camera, truth).acc),
        _share(by_targets.acc),
        _found(truth, own),
        _foreign(truth, own),
        _share(by_targets.chance),
        _share(judged_by_boxes(RigidTransform(_PITCH, np.zeros(3)) @ pose, camera, own).acc),
    )


def _share(value: float | None) -> float:
    return float("nan") if value is None else value


def _keys(counted: CountedReturns) -> list[tuple[object, ...]]:
    """Return what tells each return from all others: its scan and its position."""
    times = counted.radar_times[counted.frames].tolist()
    return [(time, *point) for time, point in zip(times, counted.points_radar_m.tolist(), strict=True)]


def _found(truth: CountedReturns, own: CountedReturns) -> float:
    known = set(_keys(own))
    sightings: dict[tuple[int, str], bool] = {}
    for frame, target, key in zip(truth.frames.tolist(), truth.targets, _keys(truth), strict=True):
        sightings[frame, target] = sightings.get((frame, target), False) or key in known
    return float(np.mean(list(sightings.values()))) if sightings else float("nan")


def _foreign(truth: CountedReturns, own: CountedReturns) -> float:
    known = set(_keys(truth))
    return float(np.mean([key not in known for key in _keys(own)])) if len(own.frames) else float("nan")


if __name__ == "__main__":
    raise SystemExit(main())
