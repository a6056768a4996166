"""Near and far topics with two azimuths of each return, opened as one radar: how many placements, and how good a pose?"""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.accuracy.figures import at_least, column, fewest, share, summed_up
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from calib_core.association.placements import find_placements
from calib_core.calibration import calibrate
from calib_core.measurements import RadarScan, RadarScans, TimeNs
from calib_core.options import GatingOptions
from calib_core.radar import direction_cosines
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.recordings.containers.writing import RecordedMessage, write_ros1_bag
from calib_core.recordings.radar.merging import Spread, aligned, merged, moments_of
from calib_core.results import Calibration
from calib_core.synthetic.files import CLOUD_TOPIC, TRANSFER_NS, cloud_message, radar_messages
from calib_core.synthetic.options import SimulationOptions, Surroundings
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.radar_returns import Antenna
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.scans import with_wrong_azimuths

__all__ = ["CASES", "ROWS", "measure_topics", "section"]

_TRIALS = 20
_FIRST_SEED = 3100
_NEAR = np.array([0.15, 0.04, 0.08])  # in range [m], u and w: bins and biases, far from the other azimuth at 0.6
_RIGHT, _RATIO = 90.0, 1.1
_BUSY = Surroundings(parked_cars=3, fence=True, strong_target_dbsm=29.0)

CASES: dict[str, SimulationOptions] = {
    "two topics per range": PRESETS["near-far-azimuths"],
    "second azimuth in a column, as often the true one": PRESETS["near-far-column"],
    "two topics per range, car park": replace(PRESETS["near-far-azimuths"], scene="field", surroundings=_BUSY),
    "two topics per range, TI AWR1843": replace(PRESETS["near-far-azimuths"], radar="awr1843"),
}
_FAR_TOPIC = f"{CLOUD_TOPIC}_far"


def measure_topics(case: str, trial: int) -> Figures:
    """Write one recording as several topics and as one ideal topic, open both, and solve the same clicks."""
    options = replace(CASES[case], seed=_FIRST_SEED + trial)
    ideal = _measured_once(simulate(replace(options, defects=replace(options.defects, second_azimuth="none"))))
    simulated = _with_wrong_azimuths(ideal, simulate(options))
    figures: Figures = {"placements": float(len(simulated.placements))}
    with tempfile.TemporaryDirectory() as folder:
        several = write_ros1_bag(Path(folder) / "several.bag", radar_messages(simulated, 1))
        one = write_ros1_bag(Path(folder) / "one.bag", _in_one_topic(ideal))
        for name, path, topic in (("merged", several, None), ("single", several, _FAR_TOPIC), ("ideal", one, None)):
            with open_recording(path, RecordingOptions(radar_topic=topic), require=("radar",)) as recording:
                scans = recording.radar_scans()
                figures[f"{name}_topics"] = float(len(recording.radar_topics))
            figures |= {f"{name}_{key}": value for key, value in _measured(simulated, scans).items()}
    return figures


@dataclass(frozen=True, eq=False, kw_only=True)
class _Measured(SimulatedRecording):
    """A simulated recording whose scans are kept, so that they are drawn once.

    Attributes:
        kept: the scans of each antenna by its name.
    """

    kept: Mapping[str, tuple[RadarScan, ...]]

    def scans_of(self, antenna: Antenna) -> Iterator[RadarScan]:
        """Yield the scans of an antenna."""
        return iter(self.kept[antenna.name])


def _measured_once(recording: SimulatedRecording) -> _Measured:
    kept = {antenna.name: tuple(recording.scans_of(antenna)) for antenna in recording.stage.antennas}
    return _Measured(recording.stage, recording.placements, recording.clicked, kept=kept)


def _with_wrong_azimuths(ideal: _Measured, several: SimulatedRecording) -> _Measured:
    """Return a recording of several topics with the draws of the ideal one."""
    kept = {
        name: tuple(with_wrong_azimuths(several.stage, scan) for scan in scans) for name, scans in ideal.kept.items()
    }
    return _Measured(several.stage, several.placements, several.clicked, kept=kept)


def _in_one_topic(ideal: _Measured) -> Iterator[RecordedMessage]:
    """Put the returns that all antennas report in one moment into one cloud; none is left out."""
    parts = [RadarScans.from_scans(list(scans)) for scans in ideal.kept.values()]
    moments = moments_of([part.times_ns for part in parts])
    together = [aligned(part, own, moments.times_ns) for part, own in zip(parts, moments.scan_of, strict=True)]
    scans = merged(together, [Spread(np.full(3, 1e-9), 1e-9)] * len(parts), list(range(len(parts))))
    for number in range(len(scans)):
        scan = scans.scan(number)
        yield cloud_message(CLOUD_TOPIC, scan, TimeNs(scan.time + TRANSFER_NS))


def _measured(simulated: SimulatedRecording, scans: RadarScans) -> Figures:
    """Search and solve one recording."""
    found = find_placements(scans, GatingOptions())
    shown = {
        true.id
        for true in simulated.placements
        for one in found
        if one.start < true.end
        and one.end > true.start
        and abs(np.linalg.norm(one.position_radar_m) - np.linalg.norm(true.position_radar_m)) < _NEAR[0]
    }
    outcome = calibrate(simulated.clicks, scans, simulated.camera)
    if not isinstance(outcome, Calibration):
        return {"found": float(len(shown)), "proposals": float(len(found)), "right": 0.0, "deg": None, "m": None}
    placement_of = {one.click.id: one.placement_id for one in simulated.clicked}
    truth = {placement.id: placement.position_radar_m for placement in simulated.placements}
    right = sum(_same(pair.point_radar_m, truth[placement_of[pair.id]]) for pair in outcome.pairs)
    error = simulated.camera_from_radar.error_from(outcome.camera_from_radar)
    return {
        "found": float(len(shown)),
        "proposals": float(len(found)),
        "right": float(right),
        "deg": float(np.rad2deg(np.linalg.norm(error[3:]))),
        "m": float(np.linalg.norm(error[:3])),
    }


def _same(one_m: np.ndarray, other_m: np.ndarray) -> bool:
    return bool((np.abs(direction_cosines(one_m) - direction_cosines(other_m)) < _NEAR).all())


def _key(case: str) -> str:
    return f"topics-{'-'.join(case.replace(',', '').split())}"


ROWS = tuple(Row(_key(case), _TRIALS, partial(measure_topics, case)) for case in CASES)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts = [], []
    for case in CASES:
        trials = kept.get(_key(case), ())
        if not trials:
            continue
        placements = int(column(trials, "placements").sum())
        right = {name: share(_flags(column(trials, f"{name}_right"), placements)) for name in _NAMES}
        found = share(_flags(column(trials, "merged_found"), placements))
        refused = sum(trial["merged_deg"] is None for trial in trials)
        ratios = [_rms(trials, f"merged_{unit}") / _rms(trials, f"ideal_{unit}") for unit in ("deg", "m")]
        judged = [at_least(right["merged"], _RIGHT), "met" if max(ratios) <= _RATIO and not refused else "missed"]
        verdicts += judged
        cells.append(
            (
                *(case, str(len(trials)), str(placements), found.percent),
                *(right[name].percent for name in _NAMES),
                *(f"{_rms(trials, f'{name}_deg'):.2f} / {100.0 * _rms(trials, f'{name}_m'):.1f}" for name in _NAMES),
                *(f"{ratios[0]:.2f} / {ratios[1]:.2f}", str(refused), " / ".join(judged)),
            )
        )
    head = (
        *("recording", "recordings", "placements", "proposed"),
        *(f"right pairs, {_WORDS[name]}" for name in _NAMES),
        *(f"pose error [deg / cm], {_WORDS[name]}" for name in _NAMES),
        *("merged over ideal", "refused", ""),
    )
    aim = "near and far topics with two azimuths: 90 % of the placements right, the pose within 1.1 times that of one ideal topic"
    claim = summed_up(aim, verdicts, fewest(kept, [row.key for row in ROWS]))
    title = "Several topics of one radar: as good as one?"
    return Section(title, _TEXT, (Part("", head, tuple(cells)),), (claim,))


_NAMES = ("merged", "single", "ideal")
_WORDS = {"merged": "merged", "single": "the far topic alone", "ideal": "one ideal topic"}


def _rms(trials: Sequence[Figures], name: str) -> float:
    values = column(trials, name)
    return float(np.sqrt(np.nanmean(values**2)))


def _flags(counts: np.ndarray, total: int) -> np.ndarray:
    """Return an array with as many ones as counted."""
    return (np.arange(total) < counts.sum()).astype(np.float64)


_TEXT = """Simulated recordings of the presets of `cocalib simulate`, radar only, written to a file as several topics and,
with the same draws, as one ideal topic; both are opened and solved with the same clicks. A pair is right if its radar
position is that of the placement: within 0.15 m, 0.04 in sine of azimuth and 0.08 in sine of elevation; the other azimuth is
0.6 away. A placement is proposed if a proposal overlaps it in time, at its range. Pose errors are root mean squares."""
