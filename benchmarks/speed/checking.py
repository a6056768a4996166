"""What checking an answer costs, in times of an earlier version's solve: `python -m benchmarks.speed.checking`."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.speed.rows import Row, Table, earlier_version, section

__all__ = ["measure_checking"]

_ROOT = Path(__file__).resolve().parents[2]
_EARLIER = "c35a642"
"""The last version before answers came in two steps."""
_AIM = 2.0
_SETS, _ROUNDS, _REPEATS = 8, 3, 3
_CASES = {
    "free": (0.0, False),
    "one pair in five wrong": (0.2, False),
    "camera position measured": (0.0, True),
    "camera position measured, one pair in five wrong": (0.2, True),
}
_SOLVE = """
import json, sys, time
import numpy as np
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
try:
    from benchmarks.simulated_pairs import simulate_pairs
    from calib_core.calibration import calibrate_pairs
except ImportError:
    from calib_core.calibrate import calibrate_pairs
    from calib_core.synthetic import simulate_pairs
share, measured, count, repeats = json.loads(sys.argv[1])
times_s = []
for seed in range(count):
    drawn = simulate_pairs(20, rng=np.random.default_rng(seed), outlier_share=share)
    place_m = tuple(drawn.camera_from_radar.inverse().translation_m.tolist())
    prior = CameraPositionPrior(place_m, 0.02) if measured else None
    options = CalibrationOptions(solving=SolvingOptions(camera_position=prior))
    spent_s = []
    for _ in range(repeats):
        start = time.process_time()
        calibrate_pairs(drawn.pairs, drawn.camera, options)
        spent_s.append(time.process_time() - start)
    times_s.append(min(spent_s))
print(json.dumps(times_s))
"""


def measure_checking(scratch: Path) -> Table:
    """Solve simulated pairs in both versions, in turn."""
    versions = (earlier_version(_EARLIER, scratch), _ROOT)
    rows = []
    for what, (share, measured) in _CASES.items():
        rounds_s = [[_times_s(version, share, measured=measured) for version in versions] for _ in range(_ROUNDS)]
        before_s, now_s = np.min(rounds_s, axis=0)
        ratio = float(np.median(now_s) / np.median(before_s))
        aim = f"at most {_AIM:g} x"
        rows.append(Row(what, f"{1000 * np.median(now_s):.0f} ms", f"{ratio:.1f} x {_EARLIER}", aim, ratio <= _AIM))
    how = (
        f"The checked answer to 20 simulated pairs of a TI-like radar, one core; processor time, median of {_SETS} sets, "
        f"the least of {_ROUNDS * _REPEATS} each. Alone: `python -m benchmarks.speed.checking`."
    )
    return Table("A checked answer", how, tuple(rows))


def _times_s(version: Path, share: float, *, measured: bool) -> list[float]:
    environment = os.environ | {"PYTHONPATH": f"{version}{os.pathsep}{version / 'app'}", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", _SOLVE, json.dumps([share, measured, _SETS, _REPEATS])]
    done = subprocess.run(command, env=environment, cwd=version, check=True, capture_output=True, text=True)
    return list(json.loads(done.stdout))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        print("\n".join(section(measure_checking(Path(folder)))))
