"""A thousand pairs: does the error keep shrinking, or does a bias remain?"""

from benchmarks.accuracy.cases import Case, bound_of, draw
from benchmarks.accuracy.efficiency import errors_of
from benchmarks.accuracy.methods import solve_ours, sqpnp_lm
from benchmarks.accuracy.rows import Figures
from benchmarks.simulated_pairs import SimulatedPairs
from calib_core.geometry import RigidTransform


def measure_many(case: Case, trial: int) -> Figures:
    """Solve one trial by the default method and by plain PnP."""
    simulated = draw(case, trial)
    bound = bound_of(simulated, case.noise, case.tape_m)
    ours, plain = solve_ours(simulated, case), sqpnp_lm(simulated, case)
    pose = None if ours is None else ours.camera_from_radar
    return (
        errors_of(simulated, pose)
        | {f"plain {name}": value for name, value in errors_of(simulated, plain).items()}
        | {"bound_rad": bound.rotation_rad, "bound_m": bound.position_m}
        | {"backwards_m": _backwards_m(simulated, pose), "plain backwards_m": _backwards_m(simulated, plain)}
    )


def _backwards_m(simulated: SimulatedPairs, pose: RigidTransform | None) -> float | None:
    """Return how far behind its true position the camera was estimated [m], the direction of PnP's bias."""
    if pose is None:
        return None
    return float(simulated.rig.camera_position_radar_m[0] - pose.inverse().translation_m[0])
