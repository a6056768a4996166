"""Measure at pair level what a fleet's prior is worth: `python -m benchmarks.fleet.prior_value [--vehicles N] [--first SEED]`.

Every fleet has 49 vehicles, each calibrated by `calibrate_pairs` from 20 simulated placements of an AWR1843; their prior is
given to 25 further vehicles, each with its own sensors. Only the tables read the truth. The seed decides every figure,
whatever the number of processes.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import chain, product
from multiprocessing import get_context

from benchmarks.fleet.paired_fleet import (
    Answer,
    Setting,
    answered,
    draw_vehicle,
    prior_from,
    prior_holds,
    sigmas,
)
from benchmarks.fleet.prior_tables import answers_table, gain_table, off_kind_table, prior_table
from benchmarks.fleet.simulated_poses import Spread

__all__ = [
    "OTHERS",
    "SETTINGS",
    "FleetFigures",
    "OffKindTrial",
    "main",
    "measure_fleet",
    "measure_gain",
    "measure_off_kind",
]

OTHERS = 49
NEXT = 25
"""Vehicles that one fleet's prior is tried on."""
FEW, MANY = 6, 20
TURNS_DEG = (2.0, 5.0, 10.0, 20.0)
SETTINGS = (
    Setting(Spread(0.005, 0.3)),
    Setting(Spread(0.05, 5.0)),
    Setting(Spread(0.02, 1.0)),
    Setting(Spread(0.005, 0.3), shared_errors=False),
)
"""The first two have as many vehicles as asked for, the others a quarter of that."""
_EVERY = 5  # one vehicle in so many is also solved with prior from all its placements
_OFF_KIND = 5  # vehicles off their kind by each turn, for each fleet
_GAIN_SPREADS = (Spread(0.005, 5.0), Spread(0.05, 5.0), Spread(0.5, 5.0))
_GAIN_PLACEMENTS = (6, 10, 20, 40)
_GAIN_VEHICLES = 20


@dataclass(frozen=True, slots=True)
class OffKindTrial:
    """A vehicle that is turned away from its kind: its answers with the prior from few and from many placements."""

    turned_deg: float
    few: Answer
    many: Answer


@dataclass(frozen=True, slots=True)
class FleetFigures:
    """What one fleet's prior did.

    Attributes:
        widened: factor of the prior's covariance.
        sigma_cm: of the prior: root of the trace, position.
        sigma_deg: the same of the rotation.
        left_out: how many of the others were not counted.
        held: for each next vehicle whether its true mounting is in the prior's 95 % ellipsoid.
        answers: of the next vehicles, by column: placements and whether the prior was given.
    """

    widened: float
    sigma_cm: float
    sigma_deg: float
    left_out: int
    held: tuple[bool, ...]
    answers: dict[tuple[int, bool], tuple[Answer, ...]]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fleet.prior_value", description=__doc__)
    parser.add_argument("--vehicles", type=int, default=1000, help="next vehicles, rounded up to 25")
    parser.add_argument("--first", type=int, default=1, metavar="SEED", help="another seed is other fleets")
    parser.add_argument("--processes", type=int, default=1)
    given = parser.parse_args()
    most = -(-given.vehicles // NEXT)
    fewer = -(-most // 4)
    counts = {setting: most if place < 2 else fewer for place, setting in enumerate(SETTINGS)}
    todo = [(setting, (given.first, number)) for setting, fleets in counts.items() for number in range(fleets)]
    with ProcessPoolExecutor(given.processes, mp_context=get_context("spawn")) as pool:
        gains = pool.map(partial(measure_gain, seed=given.first), _GAIN_SPREADS)
        turned = {
            setting: pool.map(partial(measure_off_kind, setting), [(given.first, k) for k in range(fewer)])
            for setting in SETTINGS[:3]
        }
        measured = pool.map(measure_fleet, *zip(*todo, strict=True))
        rows: dict[Setting, list[FleetFigures]] = {setting: [] for setting in SETTINGS}
        for (setting, _), figures in zip(todo, measured, strict=True):
            rows[setting].append(figures)
        off_kind = {setting: list(chain.from_iterable(fleets)) for setting, fleets in turned.items()}
    for line in chain(prior_table(rows), answers_table(rows), off_kind_table(off_kind), gain_table(tuple(gains))):
        print(line, flush=True)


def measure_fleet(setting: Setting, seed: tuple[int, int]) -> FleetFigures:
    """Draw a fleet, make its prior, and give it to vehicles that it does not contain.

    Args:
        setting: how it is drawn.
        seed: another one is another fleet.
    """
    start = (*seed, SETTINGS.index(setting))
    prior = prior_from([draw_vehicle(setting, (*start, number)) for number in range(OTHERS)])
    held: list[bool] = []
    answers: dict[tuple[int, bool], list[Answer]] = {}
    for number in range(NEXT):
        vehicle = draw_vehicle(setting, (*start, OTHERS + number))
        held.append(prior_holds(prior, vehicle.truth))
        columns = [(FEW, False), (FEW, True), (MANY, False)]
        if number % _EVERY == 0:
            columns.append((MANY, True))
        for count, with_prior in columns:
            outcome = vehicle.solved(count, prior if with_prior else None)
            answers.setdefault((count, with_prior), []).append(answered(outcome, vehicle.truth))
    cm, deg = sigmas(prior.covariance, prior.camera_from_radar)
    return FleetFigures(
        prior.widened,
        cm,
        deg,
        len(prior.left_out),
        tuple(held),
        {column: tuple(row) for column, row in answers.items()},
    )


def measure_off_kind(setting: Setting, seed: tuple[int, int]) -> tuple[OffKindTrial, ...]:
    """Try the prior of a fleet on vehicles whose camera is turned away from their kind.

    Args:
        setting: how the fleet is drawn.
        seed: another one is another fleet.
    """
    start = (*seed, 100 + SETTINGS.index(setting))
    prior = prior_from([draw_vehicle(setting, (*start, number)) for number in range(OTHERS)])
    found = []
    for (place, turned_deg), number in product(enumerate(TURNS_DEG), range(_OFF_KIND)):
        vehicle = draw_vehicle(setting, (*start, 1000 + 100 * place + number), turned_deg=turned_deg)
        few, many = (answered(vehicle.solved(placements, prior), vehicle.truth) for placements in (FEW, MANY))
        found.append(OffKindTrial(turned_deg, few, many))
    return tuple(found)


def measure_gain(spread: Spread, seed: int) -> tuple[Spread, dict[int, list[tuple[Answer, Answer]]]]:
    """Return answers without and with the prior of one fleet, for each number of placements."""
    setting = Setting(spread)
    start = (seed, 10_000 + round(1000 * spread.position_m))
    prior = prior_from([draw_vehicle(setting, (*start, number)) for number in range(OTHERS)])
    found: dict[int, list[tuple[Answer, Answer]]] = {count: [] for count in _GAIN_PLACEMENTS}
    for number in range(_GAIN_VEHICLES):
        vehicle = draw_vehicle(setting, (*start, OTHERS + number), placements=max(_GAIN_PLACEMENTS))
        for count in _GAIN_PLACEMENTS:
            without, informed = (answered(vehicle.solved(count, given), vehicle.truth) for given in (None, prior))
            found[count].append((without, informed))
    return spread, found


if __name__ == "__main__":
    main()
