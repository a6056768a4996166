"""Judge the results of a simulated fleet by its truth: what was named, what was missed, and what healthy was named.

python -m benchmarks.fleet.judging FLEET RESULTS
"""

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.fleet.truth import FleetTruth, read_truth
from calib_core.fleet import MountingScatter, Transition
from cocalib.fleet.kinds import Kind, kinds_of
from cocalib.fleet.reading import read_fleet
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord
from cocalib.fleet.standing import VehicleStanding, standings_of

__all__ = ["Judged", "judge", "judge_results", "main"]

_TRUSTED = ("good", "usable")


@dataclass(frozen=True, slots=True)
class Judged:
    """One question, asked of everything that it concerns.

    Attributes:
        question: what has to be so.
        of: how many it concerns.
        wrong: where it is not so, in words.
        named: what the product says where it has to say something.
    """

    question: str
    of: int
    wrong: tuple[str, ...]
    named: tuple[str, ...] = ()


def judge_results(fleet: Path, results: Path) -> tuple[Judged, ...]:
    """Judge a folder of results by the truth in a fleet's folder."""
    return judge(read_truth(fleet), read_fleet(results))


def judge(truth: FleetTruth, record: FleetRecord) -> tuple[Judged, ...]:
    """Judge what the product says of a fleet.

    The mounting of a wrong radar is not judged: its transitions count neither as changed nor as unchanged.

    Args:
        truth: of the fleet.
        record: its results.
    """
    kinds = kinds_of(record)
    standings = {one.vehicle.name: one for one in standings_of(record, kinds)}
    return (
        _accounted(truth, record),
        _remounts_named(truth, record),
        _wrong_radars_named(truth, standings),
        _spoilt_refused(truth, record),
        _unchanged_left_alone(truth, record),
        _healthy_of_their_kind(truth, record, kinds),
        _sound_trusted(truth, record),
    )


def _accounted(truth: FleetTruth, record: FleetRecord) -> Judged:
    known = _by_name(record)
    missing = [f"{one.name}: no result" for one in truth.sessions if one.name not in known]
    silent = [
        f"{name}: {found.outcome.status} without a reason"
        for name, found in known.items()
        if found.pose is None and not (found.outcome.reason or found.pose_problem)
    ]
    invented = [f"{name}: not in the fleet" for name in sorted(known.keys() - {one.name for one in truth.sessions})]
    unread = [f"{one.place}: {one.reason}" for one in record.unread]
    return Judged(
        "every session has a calibration or a reason why not",
        len(truth.sessions),
        (*missing, *silent, *invented, *unread),
    )


def _remounts_named(truth: FleetTruth, record: FleetRecord) -> Judged:
    steps = [(vehicle, step) for vehicle, step in _steps(record) if truth.remounts_between(vehicle.name, *_ends(step))]
    seen = {
        (vehicle.name, session)
        for vehicle, step in steps
        if step.is_remount
        for session in truth.remounts_between(vehicle.name, *_ends(step))
    }
    words = {(vehicle.name, step.after.session): step.words for vehicle, step in steps}
    wrong = [
        f"{one.name}: {words.get((one.vehicle, one.session), 'no transition ends here')}"
        for one in truth.remounted
        if (one.vehicle, one.session) not in seen
    ]
    named = [f"{vehicle.name}: {step.words}" for vehicle, step in steps if step.is_remount]
    return Judged("remounts are named", len(truth.remounted), tuple(wrong), tuple(named))


def _wrong_radars_named(truth: FleetTruth, standings: dict[str, VehicleStanding]) -> Judged:
    wrong = [
        f"{name}: nothing to look at"
        for name in sorted(truth.wrong_radars)
        if name not in standings or not standings[name].needs
    ]
    named = [
        f"{name}: {'; '.join(one.needs)}" for name, one in standings.items() if name in truth.wrong_radars and one.needs
    ]
    return Judged("vehicles with a wrong radar need a look", len(truth.wrong_radars), tuple(wrong), tuple(named))


def _spoilt_refused(truth: FleetTruth, record: FleetRecord) -> Judged:
    known, expected = _by_name(record), {"broken recording": "failed", "no clicks": "refused"}
    spoilt = [one for one in truth.sessions if one.fault in expected]
    wrong = [
        f"{one.name}: {one.fault}, but it is {known[one.name].outcome.status}"
        for one in spoilt
        if one.name in known and known[one.name].outcome.status != expected[str(one.fault)]
    ]
    return Judged("broken recordings fail, sessions without clicks are refused", len(spoilt), tuple(wrong))


def _unchanged_left_alone(truth: FleetTruth, record: FleetRecord) -> Judged:
    steps = unchanged_steps(truth, record)
    wrong = [f"{step.before.vehicle}: {step.words}" for step in steps if step.is_remount]
    return Judged("unchanged transitions are no remounts", len(steps), tuple(wrong))


def _healthy_of_their_kind(truth: FleetTruth, record: FleetRecord, kinds: Iterable[Kind]) -> Judged:
    off = dict(_off_kind(kinds))
    healthy = [name for name, found in _by_name(record).items() if name in truth.healthy and found.pose is not None]
    wrong = [f"{name}: {off[name]}" for name in healthy if name in off]
    return Judged("healthy sessions are not off their kind", len(healthy), tuple(wrong))


def _sound_trusted(truth: FleetTruth, record: FleetRecord) -> Judged:
    known = _by_name(record)
    sound = [one.name for one in truth.sessions if one.fault is None]
    wrong = [
        f"{name}: {known[name].outcome.status}, verdict {known[name].outcome.verdict}"
        for name in sound
        if name in known and known[name].outcome.verdict not in _TRUSTED
    ]
    return Judged("sound recordings give a good or usable calibration", len(sound), tuple(wrong))


def unchanged_steps(truth: FleetTruth, record: FleetRecord) -> list[Transition]:
    """Return the transitions of vehicles with the right radar between which nobody touched it."""
    return [
        step
        for vehicle, step in _steps(record)
        if vehicle.name not in truth.wrong_radars and not truth.remounts_between(vehicle.name, *_ends(step))
    ]


def _steps(record: FleetRecord) -> Iterator[tuple[VehicleRecord, Transition]]:
    return ((vehicle, step) for vehicle in record.vehicles for step in vehicle.transitions)


def _ends(step: Transition) -> tuple[str, str]:
    return step.before.session, step.after.session


def _by_name(record: FleetRecord) -> dict[str, SessionRecord]:
    return {f"{vehicle.name}/{one.name}": one for vehicle in record.vehicles for one in vehicle.sessions}


def _off_kind(kinds: Iterable[Kind]) -> Iterator[tuple[str, str]]:
    """Yield the sessions of all mountings that are off their kind, present or earlier, and what is said of them."""
    for kind in kinds:
        if isinstance(kind.scatter, MountingScatter):
            for left in kind.scatter.left_out:
                yield from ((f"{left.mounting.vehicle}/{session}", left.reason) for session in left.mounting.sessions)
        for found in kind.judged.values():
            if found.is_off:
                yield from ((f"{found.mounting.vehicle}/{session}", found.words) for session in found.mounting.sessions)


def _told(truth: FleetTruth, record: FleetRecord, judged: Sequence[Judged]) -> Iterator[str]:
    """Yield the lines that are printed."""
    yield "| what has to be so | of | wrong |"
    yield "|---|---|---|"
    for one in judged:
        yield f"| {one.question} | {one.of} | {len(one.wrong)} |"
    yield ""
    yield from (f"named: {words}" for one in judged for words in one.named)
    yield from (f"wrong: {words}" for one in judged for words in one.wrong)
    outcomes = [found.outcome for name, found in _by_name(record).items() if name in truth.healthy]
    sigma = [
        (one.sigma_deg, one.sigma_cm) for one in outcomes if one.sigma_deg is not None and one.sigma_cm is not None
    ]
    steps = unchanged_steps(truth, record)
    if sigma and steps:
        deg, cm = np.median(np.array(sigma), axis=0)
        squared = float(np.mean([step.squared for step in steps]))
        yield f"largest standard deviation about an axis of healthy sessions, median: {deg:.2f} deg, {cm:.1f} cm"
        yield f"squared distance of unchanged transitions, mean: {squared:.1f}; 6 if the covariances were exact"


def main(arguments: list[str]) -> int:
    """Print what is right and wrong; exit code 1 if something healthy is named, or something planned is not."""
    parser = argparse.ArgumentParser(prog="benchmarks.fleet.judging", description=main.__doc__)
    parser.add_argument("fleet", type=Path, help="its folder, with truth.json")
    parser.add_argument("results", type=Path, help="what cocalib batch wrote")
    given = parser.parse_args(arguments)
    truth, record = read_truth(given.fleet), read_fleet(given.results)
    judged = judge(truth, record)
    print("\n".join(_told(truth, record, judged)))
    return int(any(one.wrong for one in judged))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
