"""Errors in variables: the final fit of pose and true reflector positions, with inlier probabilities and noise levels.

Pose and true reflector positions mu are estimated together, by expectation-maximisation over

    sum_i w_i [ |z_i - pi(R p(mu_i) + t)|^2_C + |m_i - mu_i|^2_V ] + |c - c0|^2 / sigma_c^2,

with the mu_i eliminated exactly (equation (2) of `measurement_model`). The estimated `systematic_errors` are further unknowns.
Plain PnP takes the noisy m_i as the truth; the resulting bias does not shrink with more pairs. w_i is the probability that
pair i is an inlier: neither an outlier anywhere on the image nor a near outlier, several times farther off than noise
explains. Each pair is judged by its leave-one-out prediction (`leave_one_out`): a wrong pair would pass a test
against a fit and a noise level that it has itself distorted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Flags, Indices, Matrix66, Values
from calib_core.estimation.gnc import (
    INLIER_SHARE,
    LEAST_INFORMATION,
    RIDGE,
    TINY,
    GncSolution,
    associate,
    log_odds_of,
    normal_equations,
    rival_rows,
)
from calib_core.estimation.leave_one_out import (
    COMPONENTS,
    PSEUDO_SHARED,
    LeaveOneOutPrediction,
    NoiseParts,
    Symmetric,
    noise_parts,
    predict_left_out,
    shrunk_scales,
)
from calib_core.estimation.measurement_model import Linearization, MeasurementPlanes, PairMeasurements
from calib_core.estimation.pose_posterior import (
    LARGEST_EXPONENT,
    NEAR_OUTLIER_FACTOR,
    NEAR_OUTLIER_SHARE,
    NEAR_SIGMAS,
    PRIOR_INLIERS,
    PRIOR_OUTLIERS,
)
from calib_core.geometry import RigidTransform
from calib_core.measurements import MIN_PAIRS

_MOST_ROUNDS = 80  # number of steps, a choice: a fit that has not settled by then ends there
_ROUNDS_BEFORE_SCALES = 3  # steps, a choice: residuals at a pose that still moves would pass for noise
_ROUNDS_PER_WEIGHING = 3  # steps from one weighing to the next, a choice: weights settle long before noise scales do
_TOLERANCES = (1e-6, 1e-5)  # of a step in standard deviations of the pose, and of a relative change of the noise scales
_COARSE_TOLERANCES = (0.02, 0.02)  # of the same units, a choice: previews and the gain of mirrored axes need no more
_LARGEST_RATIO = 0.95  # of successive changes of the noise scales; above it nothing is extrapolated
_UNDONE, _SMALL_STEP, _MAX_DAMPING = 0.3, 1e-6, 1e4  # share of a step, squared standard deviations of the priors
_LEAST_PAIRS_FOR_SCALES = 5.0  # pairs, a choice: 10 residuals, of which the pose leaves 4
_HALF = 0.5
_MOST_ASKED, _LEAST_DECIDED = 0.2, MIN_PAIRS + 2  # share of the pairs; inliers besides them


@dataclass(frozen=True, slots=True, eq=False)
class ErrorsInVariablesFit:
    """The fit at its optimum.

    Attributes:
        camera_from_radar: the pose.
        rows: (n,) the chosen candidate row of each pair.
        weights: (n,) probability that the pair is an inlier.
        measurements: the measurements with the estimated noise and the estimated systematic errors taken out.
        polar: (3, n) estimated true positions at which the model is linearized.
        model: the linear model at the optimum, whitened by that noise.
        noise_scale: (4,) estimated over assumed sigma of (click, range, azimuth, elevation).
        degrees_of_freedom: of the noise scales, those of the assumed sigmas included; 0 if not estimated.
        inlier_share: prior probability of an inlier, estimated.
        rivals: (n,) the row of another return that explains the pair's click as well; -1 if there is none. Where only a few
            inliers have one, these count half, and are no inliers until somebody chooses.
    """

    camera_from_radar: RigidTransform
    rows: Indices
    weights: Values
    measurements: PairMeasurements
    polar: np.ndarray
    model: Linearization
    noise_scale: Values
    degrees_of_freedom: float
    inlier_share: float
    rivals: Indices

    @property
    def placements_z_m(self) -> float:
        """The median z of the chosen radar positions, as reported."""
        range_m, _, elevation_rad = self.measurements.reported[self.rows].T
        return float(np.median(range_m * np.sin(elevation_rad)))

    @property
    def inliers(self) -> Flags:
        """The pairs (n,) that are more likely inliers than not."""
        return np.asarray(self.weights > _HALF)


@dataclass(slots=True)
class _State:
    """The state of the iteration; used only inside `fit_errors_in_variables`."""

    pose: RigidTransform
    polar: np.ndarray | None
    """(3, n) true positions"""
    rows: Indices
    measured: MeasurementPlanes
    """of those rows, with the noise of the current round"""
    scale: Values
    share: float
    errors: Values
    """of the estimated systematic errors"""
    weights: Values = field(default_factory=lambda: np.zeros(0))
    change: Values = field(default_factory=lambda: np.zeros(4))
    """of the logarithm of the scales in the previous round"""
    step: Values = field(default_factory=lambda: np.zeros(0))
    """(k,) of the systematic errors in the previous round"""
    damping: float = 1.0
    """factor on their priors' information in a step, which shortens it and does not move the optimum"""

    def adapt_damping(self, step: Values, prior_information: np.ndarray) -> None:
        """Make the next steps of the systematic errors shorter if this one undoes the previous one, longer if it repeats it.

        An elevation scale on flat ground is nearly a shift of the camera, so that only its prior determines it, and steps
        from many pairs overshoot. If a step is -q times the previous one, the curvature is 1 + q times that assumed, and the
        other way around: a step undoes another, too, where the noise level has changed in between.
        """
        if len(self.step):
            length = float(self.step @ prior_information @ self.step)
            undone = -float(step @ prior_information @ self.step) / max(length, TINY)
            if undone < -_UNDONE or (undone > _UNDONE and length > _SMALL_STEP):
                self.damping = min(max(self.damping * (1.0 + undone), 1.0), _MAX_DAMPING)
        self.step = step

    def rescale(self, scale: Values, *, extrapolate: bool) -> float:
        """Set new noise scales; return their largest relative change.

        The changes shrink by a steady ratio q from round to round, at times slowly. Extrapolation (Aitken) adds what all
        later rounds would, q / (1 - q) times the change; it saves rounds and does not move the fixed point.
        """
        change = np.log(scale / self.scale)
        ratio = float(change @ self.change) / max(float(self.change @ self.change), TINY)
        if extrapolate and 0.0 < ratio < _LARGEST_RATIO:
            scale = scale * np.exp(change * (ratio / (1.0 - ratio)))
        self.scale, self.change = scale, change
        return float(np.abs(change).max())


def fit_errors_in_variables(
    measurements: PairMeasurements,
    start: GncSolution,
    *,
    estimate_scale: bool,
    coarse: bool = False,
    noise_scale: Sequence[float] | None = None,
) -> ErrorsInVariablesFit:
    """Fit pose, true positions, inlier probabilities and, optionally, the noise level.

    Args:
        measurements: all pairs with the assumed noise.
        start: the solution of graduated non-convexity.
        estimate_scale: estimate variance components once there are enough pairs.
        coarse: stop when pose and noise level are known to a few hundredths of a standard deviation.
        noise_scale: (4,) to start from; None takes the start's.
    """
    tolerances = _COARSE_TOLERANCES if coarse else _TOLERANCES
    scale = np.array(noise_scale or np.full(4, start.noise_scale))
    noisy = measurements.without_errors().scaled(scale)
    rows = associate(noisy, start.camera_from_radar)[0]
    pose, errors = start.camera_from_radar, measurements.errors.values
    state = _State(pose, None, rows, noisy.measured(rows), scale, INLIER_SHARE, errors)
    # by their plain residuals, because there is no fit yet to predict them from
    odds = log_odds_of(noisy, _model(noisy, state), noisy.log_score[state.rows], state.share)
    state.weights = _probability(odds)
    degrees = 0.0
    for round_ in range(_MOST_ROUNDS):
        noisy = measurements.scaled(state.scale).with_errors(state.errors)
        weigh = round_ <= _ROUNDS_BEFORE_SCALES or round_ % _ROUNDS_PER_WEIGHING == 0
        model, parts = _expect(noisy, state, weigh=weigh, scaled=degrees > 0.0)
        step, hessian = _maximise(noisy, state, model)
        moved = 0.0
        if estimate_scale and round_ >= _ROUNDS_BEFORE_SCALES and state.weights.sum() >= _LEAST_PAIRS_FOR_SCALES:
            scale, degrees = _variance_components(state, model, parts, hessian)
            moved = state.rescale(scale, extrapolate=round_ % _ROUNDS_PER_WEIGHING == 2)
        settled = step < tolerances[0] and moved < tolerances[1]
        if settled and round_ > _ROUNDS_BEFORE_SCALES and (weigh or coarse):
            break
    noisy = measurements.scaled(state.scale).with_errors(state.errors)
    model, _ = _expect(noisy, state, weigh=True, scaled=degrees > 0.0)
    polar = state.measured.polar if state.polar is None else state.polar
    rivals = rival_rows(noisy, state.pose, state.weights > _HALF)
    weights = _downweight_ambiguous(state.weights, rivals >= 0)
    return ErrorsInVariablesFit(
        state.pose, state.rows, weights, noisy, polar, model, state.scale, degrees, state.share, rivals
    )


def _downweight_ambiguous(weights: Values, undecided: Flags) -> Values:
    """Halve the weights (n,) of the pairs that two returns explain alike, if these are few: of most pairs, it is no question."""
    inliers = weights > _HALF
    asked = inliers & undecided
    few = asked.sum() <= _MOST_ASKED * len(weights) and (inliers & ~asked).sum() >= _LEAST_DECIDED
    return np.where(asked, _HALF, weights) if few else weights


def _probability(odds: Values) -> Values:
    return np.asarray(1.0 / (1.0 + np.exp(np.minimum(-odds, LARGEST_EXPONENT))))


def _expect(
    measurements: PairMeasurements, state: _State, *, weigh: bool, scaled: bool
) -> tuple[Linearization, NoiseParts]:
    """Associate candidates at the current pose and, if `weigh`, weight each pair by its prediction from the others (E-step)."""
    if not measurements.one_to_one:
        rows = associate(measurements, state.pose)[0]
        if state.polar is not None:
            state.polar = np.where(rows == state.rows, state.polar, measurements.measured(rows).polar)
        state.rows = rows
    state.measured = measurements.measured(state.rows)
    model = _model(measurements, state)
    parts = noise_parts(measurements, model, measurements.sigma_polar[state.rows])
    if not weigh:
        return model, parts
    predicted = predict_left_out(measurements, state.pose, model, state.weights, parts, state.scale if scaled else None)
    state.weights = _probability(_log_odds(measurements, state, model, predicted))
    inliers, count = state.weights.sum(), len(state.weights)
    state.share = float((inliers + PRIOR_INLIERS) / (count + PRIOR_INLIERS + PRIOR_OUTLIERS))
    return model, parts


def _log_odds(
    measurements: PairMeasurements, state: _State, model: Linearization, predicted: LeaveOneOutPrediction
) -> Values:
    """Return log odds (n,) of an inlier against a near outlier or an outlier anywhere on the image."""
    prior = np.log(state.share) - np.log1p(-state.share) + measurements.log_score[state.rows]
    anywhere = -prior + 0.5 * model.log_determinant + measurements.log_outlier
    near = np.log(NEAR_OUTLIER_SHARE) - np.log1p(-NEAR_OUTLIER_SHARE) + predicted.log_density(NEAR_OUTLIER_FACTOR)
    return np.asarray(predicted.log_density() - np.logaddexp(anywhere, near))


def _model(measurements: PairMeasurements, state: _State) -> Linearization:
    pose = state.pose
    return state.measured.linearize(measurements.camera, pose.rotation, pose.translation_m, state.polar)


def _maximise(measurements: PairMeasurements, state: _State, model: Linearization) -> tuple[float, Matrix66]:
    """Update pose and true positions (M-step); return the step's length in standard deviations, and the Hessian."""
    hessian, gradient = normal_equations(measurements, state.pose, model, state.weights)
    scale = np.sqrt(np.maximum(np.diag(hessian), LEAST_INFORMATION))
    damped = hessian.copy()
    damping = (
        state.damping if state.polar is not None else _MAX_DAMPING
    )  # noise would pass for a scale at measured positions
    damped[6:, 6:] += (damping - 1.0) * measurements.errors.prior_information
    step = np.linalg.solve(damped / np.outer(scale, scale) + RIDGE * np.eye(len(scale)), gradient / scale) / scale
    # steps of at most 0.2 rad and 1 m, a choice: fits start near the optimum
    longest = max(float(np.linalg.norm(step[3:6])) / 0.2, float(np.linalg.norm(step[:3])) / 1.0, 1.0)
    step = step / longest
    state.adapt_damping(step[6:], measurements.errors.prior_information)
    state.pose = state.pose.perturbed(step[:6])
    state.errors = state.errors + step[6:]
    # mu = m' + V J^T S^-1 (e - J step), from the eliminated equations
    left = model.planes[0] - (step @ model.unknown_planes.reshape(len(step), -1)).reshape(2, -1)
    pull = (model.polar_planes * left).sum(axis=1)
    near = left[0] ** 2 + left[1] ** 2 < NEAR_SIGMAS**2
    polar = measurements.with_errors(state.errors).measured(state.rows).polar
    state.polar = np.where(near, polar + state.measured.sigma_polar**2 * pull, polar)
    return float(np.sqrt(max(step @ hessian @ step, 0.0))), hessian


def _variance_components(
    state: _State, model: Linearization, parts: NoiseParts, hessian: Matrix66
) -> tuple[Values, float]:
    """Update the four noise scales from residuals and their redundancy numbers.

    With P = W^T (I - w J_pose H^-1 J_pose^T) W, component k with covariance Q_k of the residual has
    q_k = e^T S^-1 Q_k S^-1 e and redundancy r_k = tr(P Q_k); its variance changes by q_k / r_k.
    """
    weights, jacobian = state.weights, model.unknown_planes
    back = (np.linalg.inv(hessian) @ jacobian.reshape(len(hessian), -1)).reshape(jacobian.shape)
    taken = parts.squared_lengths(Symmetric.between(jacobian, back))
    redundant = ((parts.planes**2).sum(axis=1) - weights * taken) @ weights
    squares = (parts.along**2 @ weights) @ COMPONENTS
    redundant = np.maximum(redundant @ COMPONENTS, 0.0)
    return shrunk_scales(squares * state.scale**2, redundant), float(redundant.sum()) + PSEUDO_SHARED
