"""The final fit: errors in variables, with a mixture that says which pairs to believe and how large the noise really is.

Pose and true reflector positions mu are estimated together, by expectation-maximisation over

    sum_i w_i [ |z_i - pi(R p(mu_i) + t)|^2_C + |m_i - mu_i|^2_V ] + |c - c0|^2 / sigma_c^2,

the mu_i eliminated exactly (equation (2) of `evidence`). Plain PnP takes the noisy m_i for the truth; its bias does not
shrink with more pairs. w_i is the probability that pair i is no outlier (a click anywhere on the image is one).
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, TimesNs, Values
from calib_core.consensus import Consensus, associate, log_odds_of, normal_equations
from calib_core.evidence import Evidence, Linearised, linearise
from calib_core.geometry import RigidTransform

__all__ = ["Refined", "refine"]

_MOST_ROUNDS = 80
_ROUNDS_BEFORE_SCALES = 3
_STEP_TOLERANCE = 1e-8  # in standard deviations of the pose
_PRIOR_INLIERS, _PRIOR_OUTLIERS = 3.0, 0.5  # pseudo-counts of the inlier share
_PSEUDO_REDUNDANCY = 6.0  # pseudo-degrees of freedom that pull each noise scale to what it leans on
_PSEUDO_SHARED = 4.0
_SCALE_LIMITS = (0.1, 12.0)
_LEAST_PAIRS_FOR_SCALES = 5.0
_NEAR = 6.0  # standard deviations beyond which a pair says nothing about its own true position


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """The fit at its optimum.

    Attributes:
        camera_from_radar: the pose.
        rows: (n,) the chosen candidate row of each pair.
        weights: (n,) probability that the pair is an inlier.
        evidence: the evidence with the estimated noise.
        model: the linear model at the optimum, whitened by that noise.
        noise_scale: (4,) estimated over assumed sigma of (click, range, azimuth, elevation).
        degrees_of_freedom: that went into the noise scales, the assumed sigmas' own included; 0 where not estimated.
        inlier_share: prior probability of an inlier, estimated.
    """

    camera_from_radar: RigidTransform
    rows: TimesNs
    weights: Values
    evidence: Evidence
    model: Linearised
    noise_scale: Values
    degrees_of_freedom: float
    inlier_share: float


@dataclass(slots=True)
class _State:
    """Where the rounds stand; lives only inside `refine`."""

    pose: RigidTransform
    polar: Points3 | None
    rows: TimesNs
    scale: Values
    share: float


def refine(evidence: Evidence, start: Consensus, *, estimate_scale: bool) -> Refined:
    """Fit pose, true positions, inlier probabilities and, if wanted, the noise level.

    Args:
        evidence: all pairs with the assumed noise.
        start: where graduated non-convexity ended.
        estimate_scale: estimate variance components once there are enough pairs.
    """
    state = _State(start.camera_from_radar, None, np.zeros(0, dtype=np.int64), np.full(4, start.noise_scale), 0.8)
    state.rows = associate(evidence, state.pose)[0]
    degrees = 0.0
    for round_ in range(_MOST_ROUNDS):
        noisy = evidence.scaled(state.scale)
        model, weights = _expect(noisy, state)
        step = _maximise(noisy, state, model, weights)
        moved = 0.0
        if estimate_scale and round_ >= _ROUNDS_BEFORE_SCALES and weights.sum() >= _LEAST_PAIRS_FOR_SCALES:
            before = state.scale
            state.scale, degrees = _variance_components(noisy, state, model, weights)
            moved = float(np.abs(np.log(state.scale / before)).max())
        if step < _STEP_TOLERANCE and moved < 1e-6 and round_ > _ROUNDS_BEFORE_SCALES:
            break
    noisy = evidence.scaled(state.scale)
    model, weights = _expect(noisy, state)
    return Refined(state.pose, state.rows, weights, noisy, model, state.scale, degrees, state.share)


def _expect(evidence: Evidence, state: _State) -> tuple[Linearised, Values]:
    """Associate candidates and weigh pairs at the present pose (E-step)."""
    if not evidence.one_to_one:
        rows = associate(evidence, state.pose)[0]
        if state.polar is not None:
            state.polar = np.where((rows == state.rows)[:, None], state.polar, evidence.polar[rows])
        state.rows = rows
    model = _model(evidence, state)
    odds = log_odds_of(evidence, model, evidence.log_score[state.rows], state.share)
    weights = np.asarray(1.0 / (1.0 + np.exp(-np.clip(odds, -500.0, 500.0))))
    state.share = float((weights.sum() + _PRIOR_INLIERS) / (len(weights) + _PRIOR_INLIERS + _PRIOR_OUTLIERS))
    return model, weights


def _model(evidence: Evidence, state: _State) -> Linearised:
    return linearise(
        state.pose,
        evidence.camera,
        pixels_px=evidence.pixels_px,
        sigma_px=evidence.sigma_px,
        polar=evidence.polar[state.rows],
        sigma_polar=evidence.sigma_polar[state.rows],
        at_polar=state.polar,
    )


def _maximise(evidence: Evidence, state: _State, model: Linearised, weights: Values) -> float:
    """Step pose and true positions (M-step); return the step's length in standard deviations."""
    hessian, gradient = normal_equations(evidence, state.pose, model, weights)
    scale = np.sqrt(np.maximum(np.diag(hessian), 1e-12))
    step = np.linalg.solve(hessian / np.outer(scale, scale) + 1e-12 * np.eye(6), gradient / scale) / scale
    longest = max(float(np.linalg.norm(step[3:])) / 0.2, float(np.linalg.norm(step[:3])) / 1.0, 1.0)
    step = step / longest
    state.pose = state.pose.perturbed(step)
    # mu = m + V J^T S^-1 (e - J_pose step), from the eliminated equations
    left = model.residual - (model.pose_jacobian @ step)
    pull = (np.swapaxes(model.point_jacobian, 1, 2) @ left[:, :, None])[:, :, 0]
    polar = evidence.polar[state.rows]
    near = (left[:, 0] ** 2 + left[:, 1] ** 2) < _NEAR**2
    state.polar = np.where(near[:, None], polar + evidence.sigma_polar[state.rows] ** 2 * pull, polar)
    return float(np.sqrt(max(step @ hessian @ step, 0.0)))


def _variance_components(evidence: Evidence, state: _State, model: Linearised, weights: Values) -> tuple[Values, float]:
    """Update the four noise scales from residuals and their redundancy numbers.

    With P = W^T (I - w J_pose H^-1 J_pose^T) W, component k with covariance Q_k of the residual has
    q_k = e^T S^-1 Q_k S^-1 e and redundancy r_k = tr(P Q_k); its variance changes by q_k / r_k.
    """
    hessian, _ = normal_equations(evidence, state.pose, model, weights)
    jacobian = model.pose_jacobian
    projector = np.eye(2) - weights[:, None, None] * (jacobian @ np.linalg.inv(hessian) @ np.swapaxes(jacobian, 1, 2))
    click = model.whitening * evidence.sigma_px[:, None, None]  # W C^(1/2), (n, 2, 2)
    radar = model.point_jacobian * evidence.sigma_polar[state.rows][:, None, :]  # W J V^(1/2), (n, 2, 3)
    factors = [click, radar[:, :, 0:1], radar[:, :, 1:2], radar[:, :, 2:3]]
    found, redundant = np.empty(4), np.empty(4)
    for k, factor in enumerate(factors):
        along = (np.swapaxes(factor, 1, 2) @ model.residual[:, :, None])[:, :, 0]
        found[k] = weights @ (along**2).sum(axis=1)
        redundant[k] = weights @ np.einsum("nia,nij,nja->n", factor, projector, factor)
    return _shrunk(found * state.scale**2, np.maximum(redundant, 0.0)), float(redundant.sum()) + _PSEUDO_SHARED


def _shrunk(squares: Values, redundant: Values) -> Values:
    """Turn sums of squares, in assumed sigmas, into scales, each leaning on what is known better than itself.

    The click leans on its assumed sigma; range, azimuth and elevation lean on the level they share, and that on 1.
    """
    shared = (squares[1:].sum() + _PSEUDO_SHARED) / (redundant[1:].sum() + _PSEUDO_SHARED)
    towards = np.array([1.0, shared, shared, shared])
    variance = (squares + _PSEUDO_REDUNDANCY * towards) / (redundant + _PSEUDO_REDUNDANCY)
    return np.clip(np.sqrt(variance), *_SCALE_LIMITS)
