"""Which pairs agree, and on what pose: graduated non-convexity on whitened residuals, candidates associated on the way.

Residuals are whitened by S = C + J V J^T, so one radius in standard deviations serves every radar, range and lens; a
threshold in pixels cannot. The radius of the Geman-McClure loss shrinks from "nearly least squares" to "nearly a vote".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import TimesNs, Values
from calib_core.evidence import Evidence, Linearised, linearise
from calib_core.geometry import RigidTransform

__all__ = ["Consensus", "associate", "find_consensus", "log_odds_of", "mixture_cost", "normal_equations"]

RADII = (12.0, 8.0, 5.5, 4.0, 3.0)
"""Of the Geman-McClure loss, in standard deviations, one after the other."""

_STEPS_PER_RADIUS = 2
_INLIER_SHARE = 0.8
_SAME_POSE = 0.25  # squared distance, in standard deviations
_NOISE_SCALES = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)
_SCALE_PENALTY = 4.0  # how much better a larger noise level must explain the pairs than the assumed one


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """A pose that a set of pairs agrees on.

    Attributes:
        camera_from_radar: the pose.
        cost: twice the negative log-likelihood of pose and pairs under the inlier / outlier mixture.
        noise_scale: by how much the assumed noise must grow for the residuals to look like noise; at least 1.
    """

    camera_from_radar: RigidTransform
    cost: float
    noise_scale: float


def find_consensus(
    evidence: Evidence, starts: Sequence[RigidTransform], *, estimate_scale: bool
) -> tuple[Consensus, ...]:
    """Refine every start by graduated non-convexity; the most likely pose first.

    Args:
        evidence: the pairs.
        starts: poses to begin at.
        estimate_scale: allow a larger noise than assumed.
    """
    scales = _NOISE_SCALES if estimate_scale else _NOISE_SCALES[:1]
    found: list[Consensus] = []
    for start in starts:
        pose = _graduated(evidence, start, [other.camera_from_radar for other in found])
        if pose is not None:
            costs = _mixture_costs(evidence, pose, scales)
            best = int(np.argmin(costs))
            found.append(Consensus(pose, costs[best], scales[best]))
    return tuple(sorted(found, key=lambda one: one.cost))


def _graduated(evidence: Evidence, start: RigidTransform, known: Sequence[RigidTransform]) -> RigidTransform | None:
    """Follow the shrinking radius from one start; None as soon as it runs into a pose that is known already."""
    pose = start
    for radius in RADII:
        for _ in range(_STEPS_PER_RADIUS):
            model = associate(evidence, pose)[1]
            weights = (1.0 + model.squared / radius**2) ** -2.0
            hessian, gradient = normal_equations(evidence, pose, model, weights)
            pose = pose.perturbed(_damped(hessian, gradient))
        errors = [other.error_from(pose) for other in known]
        if any(error @ hessian @ error < _SAME_POSE for error in errors):
            return None
    return pose


def associate(evidence: Evidence, pose: RigidTransform) -> tuple[TimesNs, Linearised]:
    """Choose for each pair the candidate row that explains its pixel best: rows (n,) and the model of those rows.

    The choice maximises log score + log N(e; 0, S).
    """
    each = evidence if evidence.one_to_one else evidence.candidates_apart()
    model = linearise(
        pose,
        each.camera,
        pixels_px=each.pixels_px,
        sigma_px=each.sigma_px,
        polar=each.polar,
        sigma_polar=each.sigma_polar,
    )
    if evidence.one_to_one:
        return np.arange(len(evidence)), model
    cost = model.squared + model.log_determinant - 2.0 * evidence.log_score
    order = np.lexsort((cost, evidence.owner))  # by pair, the cheapest candidate first
    rows = order[evidence.first[:-1]]
    return rows, Linearised(
        residual=model.residual[rows],
        pose_jacobian=model.pose_jacobian[rows],
        point_jacobian=model.point_jacobian[rows],
        log_determinant=model.log_determinant[rows],
        whitening=model.whitening[rows],
    )


def normal_equations(
    evidence: Evidence, pose: RigidTransform, model: Linearised, weights: Values
) -> tuple[np.ndarray, np.ndarray]:
    """Return the Gauss-Newton Hessian (6, 6) and the descent direction's right-hand side (6,), prior included."""
    root = np.sqrt(weights)[:, None]
    jacobian = (model.pose_jacobian * root[:, :, None]).reshape(-1, 6)
    residual = (model.residual * root).reshape(-1)
    prior_residual, prior_jacobian = evidence.belief.rows(pose)
    hessian = jacobian.T @ jacobian + prior_jacobian.T @ prior_jacobian
    return hessian, jacobian.T @ residual + prior_jacobian.T @ prior_residual


def _damped(hessian: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Solve for a step, held to 0.5 rad and 2 m, with a whiff of damping where the pairs leave a direction open."""
    scale = np.sqrt(np.maximum(np.diag(hessian), 1e-12))
    step = np.linalg.solve(hessian / np.outer(scale, scale) + 1e-9 * np.eye(6), gradient / scale) / scale
    longest = max(float(np.linalg.norm(step[3:])) / 0.5, float(np.linalg.norm(step[:3])) / 2.0, 1.0)
    return np.asarray(step / longest)


def log_odds_of(evidence: Evidence, model: Linearised, log_score: Values, inlier_share: float) -> Values:
    """Return log odds (n,) of inlier against outlier: normal noise against a click anywhere on the image."""
    area_px2 = evidence.camera.width_px * evidence.camera.height_px
    log_normal = -0.5 * (model.squared + model.log_determinant) - np.log(2.0 * np.pi)
    prior = np.log(inlier_share) - np.log1p(-inlier_share)
    return np.asarray(prior + log_score + log_normal + np.log(area_px2))


def mixture_cost(evidence: Evidence, pose: RigidTransform) -> float:
    """Return twice the negative log-likelihood of the mixture, against "all are outliers", with what is known of the camera."""
    return _mixture_costs(evidence, pose, (1.0,))[0]


def _mixture_costs(evidence: Evidence, pose: RigidTransform, scales: Sequence[float]) -> list[float]:
    """Return the cost if all noise were larger by each scale: S grows by its square, log det S by 4 log scale."""
    rows, model = associate(evidence, pose)
    belief = evidence.belief.cost(pose)
    costs = []
    for scale in scales:
        grown = replace(
            model,
            residual=model.residual / scale,
            log_determinant=model.log_determinant + 4.0 * np.log(scale),
        )
        odds = log_odds_of(evidence, grown, evidence.log_score[rows], _INLIER_SHARE)
        costs.append(float(-2.0 * np.logaddexp(0.0, odds).sum()) + belief + _SCALE_PENALTY * (scale > 1.0))
    return costs
