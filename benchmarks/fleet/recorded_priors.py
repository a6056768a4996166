"""What the prior of a simulated fleet of recordings is worth, by its truth.

python -m benchmarks.fleet.recorded_priors FLEET RESULTS

Each sound vehicle is given the prior of the others, as `cocalib fleet prior --without` writes it: is its true mounting where the
prior says, and are the answers with it as far off as they state? Only the tables read the truth.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.fleet.paired_fleet import Answer, answered, sigmas
from benchmarks.fleet.prior_tables import ANSWER_HEADINGS, answer_cells
from benchmarks.fleet.truth import FleetTruth, TrueSession, read_truth
from calib_core.fleet.mounting_coordinates import coordinate_jacobian
from calib_core.fleet.tails import quantile
from calib_core.fleet_prior import FleetPrior
from calib_core.measurements import Unsolvable
from calib_core.recordings import open_recording
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.manifest_files.reading import read_manifest
from cocalib.fleet.index import read_fleet
from cocalib.fleet.kinds import prior_of_type
from cocalib.fleet.records import FleetRecord
from cocalib.solving.recorded_clicks import clicks_in_recording, file_of_clicks
from cocalib.solving.solving import required_camera, solve_clicks

__all__ = ["Given", "held_by", "main"]

_CHI2_3 = 7.814727903251179  # the 95 % quantile with 3 degrees of freedom
_BLOCKS = {"position": slice(0, 3), "rotation": slice(3, 6)}


@dataclass(frozen=True, slots=True)
class Given:
    """What an answer is made from: every so many-th click, the prior, the measured camera position."""

    every: int
    prior: bool
    tape: bool = False

    @property
    def text(self) -> str:
        """As it stands in the table."""
        parts = [f"1 in {self.every} clicks" if self.every > 1 else "all clicks"]
        return ", ".join(parts + ["tape"] * self.tape + ["prior"] * self.prior)


_COLUMNS = (
    Given(4, False),
    Given(4, True),
    Given(4, True, True),
    Given(1, False),
    Given(1, True),
    Given(1, True, True),
)


def held_by(prior: FleetPrior, truth: TrueSession) -> dict[str, bool]:
    """Return whether a true mounting is inside the prior's 95 % region, all six coordinates together and by parts."""
    jacobian = coordinate_jacobian(prior.camera_from_radar, prior.camera_from_radar)
    away = jacobian @ truth.camera_from_radar.error_from(prior.camera_from_radar)
    covariance = jacobian @ prior.covariance @ jacobian.T

    def squared(part: slice) -> float:
        return float(away[part] @ np.linalg.solve(covariance[part, part], away[part]))

    inside = {"all": squared(slice(0, 6)) <= quantile(0.95, float("inf"))}
    return inside | {name: squared(part) <= _CHI2_3 for name, part in _BLOCKS.items()}


def _priors(truth: FleetTruth, record: FleetRecord) -> Iterator[tuple[TrueSession, FleetPrior]]:
    """Yield the last healthy session of each vehicle with the prior of the others."""
    last = {one.vehicle: one for one in truth.sessions if one.name in truth.healthy}
    for vehicle in record.vehicles:
        if vehicle.name in last and vehicle.vehicle_type is not None:
            found = prior_of_type(record, vehicle.vehicle_type, (vehicle.name,))
            if not isinstance(found, Unsolvable):
                yield last[vehicle.name], found.prior


def _answer(row: ManifestRow, truth: TrueSession, prior: FleetPrior, given: Given) -> Answer:
    options = row.options
    if not given.tape:
        options = replace(options, solving=replace(options.solving, camera_position=None))
    assert row.clicks is not None
    with open_recording(row.recording, row.topics) as recording:
        camera = required_camera(recording, None)
        clicks = clicks_in_recording(file_of_clicks(row.clicks).clicks, recording, camera, source=row.clicks).clicks
        chosen = clicks[:: given.every]
        outcome = solve_clicks(recording, chosen, camera, options, prior if given.prior else None)
    return answered(outcome, truth.camera_from_radar)


def _told(priors: Sequence[tuple[TrueSession, FleetPrior]], rows: Mapping[str, ManifestRow]) -> Iterator[str]:
    held = [held_by(prior, one) for one, prior in priors]
    spreads = np.array([sigmas(prior.covariance, prior.camera_from_radar) for _, prior in priors])
    inside = ", ".join(f"{sum(one[name] for one in held)} ({name})" for name in ("all", *_BLOCKS))
    cm, deg = np.median(spreads, axis=0)
    yield f"true mountings inside the 95 % region of the others' prior, of {len(held)}: {inside}"
    yield f"its sigma: {cm:.2f} cm, {deg:.2f} deg (roots of the traces, median)"
    yield ""
    yield f"| given | {ANSWER_HEADINGS} |"
    yield "|---" * (2 + ANSWER_HEADINGS.count("|")) + "|"
    for given in _COLUMNS:
        answers = [_answer(rows[one.name], one, prior, given) for one, prior in priors]
        yield f"| {given.text} | {answer_cells(answers, [answers])} |"


def main(arguments: list[str]) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="benchmarks.fleet.recorded_priors", description=main.__doc__)
    parser.add_argument("fleet", type=Path, help="its folder, with truth.json and manifest.toml")
    parser.add_argument("results", type=Path, help="what cocalib batch wrote")
    given = parser.parse_args(arguments)
    rows = {f"{one.vehicle}/{one.session}": one for one in read_manifest(given.fleet / "manifest.toml").rows}
    for line in _told(tuple(_priors(read_truth(given.fleet), read_fleet(given.results))), rows):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
