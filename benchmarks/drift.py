"""Two calibrations of the same sensors: how often does the comparison take nothing for a change, and find a change that is there?

python -m benchmarks.drift [--seed 1] [--draws 1000] [--checked]

Each draw simulates one rig twice, with the errors of radar and lens in common and those of the person drawn anew, one pair in ten
wrong, and solves either set of pairs. A row without a change counts how often the test finds one all the same; the others change
the second rig by the size that the comparison says it would have noticed in 95 of 100, along one axis, or by 1 deg of yaw.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.simulated_pairs import NoiseName, draw_systematic_errors, simulate_pairs, study_camera
from calib_core.arrays import Values
from calib_core.calibration import calibrate_pairs, preview_pairs
from calib_core.estimation.pose_change import AXES, PoseChange, pose_change
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.synthetic.rig import Rig, random_rig

__all__ = ["main"]

_PAIRS, _WRONG, _TAPE_M = 24, 0.1, 0.01
_LEVELS = (0.05, 0.001)
_POWER_SHARE = 10  # so many draws without a change for each one with one


@dataclass(frozen=True, slots=True)
class _Case:
    """Which radar, whether each session measures the camera position, and whether the same person clicks."""

    noise: NoiseName
    taped: bool
    same_person: bool = False

    @property
    def cells(self) -> tuple[str, ...]:
        return self.noise, "1 cm" if self.taped else "none", "same" if self.same_person else "another"


_CASES = (
    _Case("imaging", taped=False),
    _Case("ti", taped=False, same_person=True),
    _Case("imaging", taped=True, same_person=True),
    _Case("ti", taped=True),
)


def _changed(rig: Rig, sizes: Values) -> Rig:
    """Turn and move the camera by sizes (6,) along AXES [deg, cm]."""
    turned = rig.camera_from_radar.rotation @ rotation_exp(np.deg2rad(sizes[:3]))
    position_m = rig.camera_position_radar_m + sizes[3:] / 100.0
    return replace(rig, camera_from_radar=RigidTransform(turned, -turned @ position_m))


def _compared(case: _Case, seed: list[int], sizes: Values, *, checked: bool) -> PoseChange | str:
    rng = np.random.default_rng(seed)
    rig = random_rig(rng, camera=study_camera())
    shared, solved = draw_systematic_errors(rng), []
    for seen in (rig, _changed(rig, sizes)):
        person = shared if case.same_person else draw_systematic_errors(rng)
        errors = replace(shared, click_offset_px=person.click_offset_px, reflector_offset_m=person.reflector_offset_m)
        pairs = simulate_pairs(_PAIRS, rng=rng, noise=case.noise, outlier_share=_WRONG, rig=seen, systematic=errors)
        options = CalibrationOptions()
        if case.taped:
            x_m, y_m, z_m = (seen.camera_position_radar_m + _TAPE_M * rng.standard_normal(3)).tolist()
            options = CalibrationOptions(solving=SolvingOptions(CameraPositionPrior((x_m, y_m, z_m), _TAPE_M)))
        solved.append((calibrate_pairs if checked else preview_pairs)(pairs.pairs, pairs.camera, options))
    first, second = solved
    if not (isinstance(first, Calibration) and isinstance(second, Calibration)):
        return "no pose"
    return pose_change(first, second, same_lens=True, same_person=case.same_person)


def _rows(seed: int, draws: int, *, checked: bool) -> Iterator[str]:
    yield f"| radar | tape | person | change | draws | {' | '.join(f'at {level:.1%}' for level in _LEVELS)} | not compared |"
    yield "|---" * (6 + len(_LEVELS)) + "|"
    for number, case in enumerate(_CASES):
        found = [_compared(case, [seed, number, draw], np.zeros(6), checked=checked) for draw in range(draws)]
        yield _row(case, "none", found)
        sizes = np.median([one.noticeable(_LEVELS[0]) for one in found if isinstance(one, PoseChange)], axis=0)
        for axis, name in enumerate(AXES):
            unit = "deg" if axis < 3 else "cm"
            changes = [f"{sizes[axis]:.2g} {unit} {name}", *(["1 deg yaw"] if name == "yaw" else [])]
            for which, change in enumerate(changes):
                moved = []
                for draw in range(draws // _POWER_SHARE):
                    place, given = [seed, number, axis + 1, draw], np.zeros(6)
                    if which:
                        given[axis] = 1.0
                    else:  # the size is that which this very draw states
                        without = _compared(case, place, given, checked=checked)
                        given[axis] = without.noticeable(_LEVELS[0])[axis] if isinstance(without, PoseChange) else 0.0
                    moved.append(_compared(case, place, given, checked=checked))
                yield _row(case, change, moved)


def _row(case: _Case, change: str, found: list[PoseChange | str]) -> str:
    p_values = np.array([one.p_value for one in found if isinstance(one, PoseChange)])
    shares = (f"{np.mean(p_values < level):.1%}" for level in _LEVELS)
    return f"| {' | '.join((*case.cells, change, str(len(found)), *shares, str(len(found) - len(p_values))))} |"


def main(arguments: list[str]) -> int:
    """Print a table of the shares that the test calls a change, at two levels."""
    parser = argparse.ArgumentParser(prog="benchmarks.drift", description=main.__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--draws", type=int, default=1000, help="without a change; a tenth as many with each change")
    parser.add_argument("--checked", action="store_true", help="solve with all checks, not locally: five times as long")
    given = parser.parse_args(arguments)
    for line in _rows(given.seed, given.draws, checked=given.checked):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
