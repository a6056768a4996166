"""What the same radar and lens get wrong in two sessions of a vehicle, and how much of it is left in the difference of the poses.

python -m benchmarks.fleet.shared_errors [--draws 40]

Two sets of pairs, at other places and with other noise, are each solved with and without errors of radar and lens, which are
drawn as the solver assumes them. The changes of the two poses are what these errors do.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.fleet.plan import TAPE_SIGMA_M
from benchmarks.fleet.simulated_session import RECORDING
from calib_core.calibration import calibrate_pairs
from calib_core.geometry import RigidTransform, camera_position_jacobian
from calib_core.options import CalibrationOptions, CameraPositionPrior, LensOptions, ReflectorOptions
from calib_core.results import Calibration
from calib_core.synthetic import (
    PairsLayout,
    Rig,
    SystematicErrors,
    draw_systematic_errors,
    random_rig,
    simulate_pairs,
    typical_camera,
)

__all__ = ["main"]

_LAYOUT = PairsLayout(max_height_m=1.5)
_LENS_WIDTH_PX = 1920.0
_NO_OFFSETS = ReflectorOptions(offset_sigma_m=0.0, click_offset_sigma_px=0.0)


def _solved(seed: list[int], rig: Rig, errors: SystematicErrors, *, tape: bool) -> Calibration:
    rng = np.random.default_rng(seed)
    pairs = simulate_pairs(RECORDING.placements, rng=rng, noise="imaging", layout=_LAYOUT, rig=rig, systematic=errors)
    options = CalibrationOptions()
    if tape:
        forward_m, left_m, up_m = rig.camera_position_radar_m.tolist()
        prior = CameraPositionPrior((forward_m, left_m, up_m), TAPE_SIGMA_M)
        options = replace(options, solving=replace(options.solving, camera_position=prior))
    found = calibrate_pairs(pairs.pairs, pairs.camera, options)
    assert isinstance(found, Calibration)
    return found


def _variances(covariance: np.ndarray, pose: RigidTransform) -> np.ndarray:
    """Return mean variances along the axes of the rotation [rad2] and of the camera position [m2] of a (6, 6)."""
    jacobian = camera_position_jacobian(pose)
    return np.array([np.trace(covariance[3:, 3:]), np.trace(jacobian @ covariance @ jacobian.T)]) / 3.0


def _rows(draws: int) -> Iterator[str]:
    yield "| tape | stated for a session | of radar and lens | of these left in the difference | error bars narrower by at most |"
    yield "|---|---|---|---|---|"
    lens = LensOptions()
    lens = replace(lens, principal_point_sigma_px=lens.principal_point_sigma_px * RECORDING.width_px / _LENS_WIDTH_PX)
    camera = typical_camera("plumb_bob", width_px=RECORDING.width_px, height_px=RECORDING.height_px)
    for tape in (True, False):
        stated, caused, left = [], [], []
        for draw in range(draws):
            rng = np.random.default_rng([draw, 0])
            rig = random_rig(rng, camera=camera)
            errors = draw_systematic_errors(rng, lens=lens, reflector=_NO_OFFSETS)
            changes = []
            for session in (1, 2):
                sound, wrong = (_solved([draw, session], rig, one, tape=tape) for one in (SystematicErrors(), errors))
                changes.append(wrong.camera_from_radar.error_from(sound.camera_from_radar))
                stated.append(_variances(sound.covariance, rig.camera_from_radar))
                caused.append(_variances(np.outer(changes[-1], changes[-1]), rig.camera_from_radar))
            difference = changes[1] - changes[0]
            left.append(_variances(np.outer(difference, difference), rig.camera_from_radar))
        total, shared, rest = np.median(stated, axis=0), np.mean(caused, axis=0), np.mean(left, axis=0)
        narrower = 100.0 * (1.0 - np.sqrt(np.maximum(1.0 - (shared - rest / 2.0) / total, 0.0)))
        cells = [*(_text(one) for one in (total, shared, rest)), f"{narrower[0]:.0f} %, {narrower[1]:.0f} %"]
        yield f"| {'1 cm' if tape else 'none'} | {' | '.join(cells)} |"


def _text(variances: np.ndarray) -> str:
    return f"{np.degrees(np.sqrt(variances[0])):.2f} deg, {100.0 * np.sqrt(variances[1]):.1f} cm"


def main(arguments: list[str]) -> int:
    """Print a table of standard deviations along one axis."""
    parser = argparse.ArgumentParser(prog="benchmarks.fleet.shared_errors", description=main.__doc__)
    parser.add_argument("--draws", type=int, default=40, help="vehicles, with two sessions each")
    for line in _rows(parser.parse_args(arguments).draws):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
