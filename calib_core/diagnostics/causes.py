"""Causes: what that all pairs share, and that is no unknown of the fit, would explain the residuals?

A cause is a column g of the design: a quantity (range, azimuth, elevation, column or row of the click) times a shape over the
placements (constant, the range, the azimuth, its square, ...), an error of the lens, or a step between two placements in time.
With whitened residuals e, whitened Jacobians J of the pose and of the estimated errors, priors included, and
M = I - J (J^T J)^-1 J^T, which removes what these can explain,

    a = g^T M e / g^T M g,    var a = (s + sum_w (g^T M B_w)^2 / g^T M g) / g^T M g,

with s the noise that is left, because it was estimated from residuals that the cause had made larger, and B_w what else is
uncertain: the errors that only widen the covariance, with their priors, and smooth angle errors (`covariance`). So what is within
a prior is no cause. A test takes one step from the optimum and needs no second fit. The level is that of all causes together; a
new cause is one shape or one quantity more.

A wrong principal point cannot be detected: the rotation absorbs it. A radar without elevation is not tested: its own residuals
grow toward the near placements.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Values
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.covariance import smooth_rows, weighted_rows, widening_rows
from calib_core.estimation.measurement_model import prior_rows
from calib_core.measurements import Facts
from calib_core.results import DataWarning

LEVEL = 0.01  # probability that any cause is named in a sound set
_LEAST_PAIRS = 10  # a choice: of 20 residuals the pose takes 6, and the estimated errors and the noise some
_LEAST_LEFT = 0.05  # share of the residual's degrees of freedom that must stay unexplained
_SMOOTH_RAD = np.deg2rad(14.0)  # correlation length, of those of `covariance` and `angle_map` (10 to 32 deg)
_SMOOTH_VARIANCE, _SMOOTH_VARIANCE_OF_STEPS = 0.25, 4.0
"""Of angle errors that neighboring placements share, over the noise's. Steps are tested against twice the noise: placements that
walk across the view turn one into the other."""
_SHARES = {"turn": 0.3, "move": 0.05, "range step": 0.05, "stated": 0.3, "other": 0.3}
"""Of the level: of steps by their kind, of what has a prior, and of everything else."""
_MOST_SPLITS, _LEAST_PLACEMENTS = 15, 4  # number of splits tried; pairs on each side of one (a choice)
_DIFFERENT = 0.25  # share of the tests of a kind that count: neighboring shapes and splits are nearly the same
_COST = 2.0  # of the statistic, for each unknown of a cause (Akaike)
_PLAUSIBLE: Mapping[str, float] = {
    "range": 0.5,
    "azimuth": np.deg2rad(0.2),
    "elevation": np.deg2rad(0.2),
    "column": 5.0,
    "row": 5.0,
    "focal length": 0.02,
    "distortion": 15.0,
    "turn": np.deg2rad(1.0),
    "move": 0.1,
    "range step": 0.1,
}
"""How large each is if it is there, where it does most [m, rad, px, share]; half of them are smaller. Guesses: a forgotten
distortion moves the corners of an image by tens of pixels, an array is off by part of its beam, a bump turns by a degree."""
_UNUSUAL = 6.0  # cost of a cause that the options state no prior of: a likelihood ratio of 20
_BESIDE = 6.0  # fall of the statistic up to which another cause is not told apart: a likelihood ratio of 20

Shape = Callable[[np.ndarray], Values]
"""Turns true positions (3, n), range [m], azimuth and elevation [rad], into a factor (n,)."""
_SHAPES: Mapping[str, Shape] = {
    "": lambda polar: np.ones(polar.shape[1]),
    "range": lambda polar: polar[0] - polar[0].mean(),
    "nearness": lambda polar: 1.0 / polar[0],
    "azimuth": lambda polar: polar[1],
    "elevation": lambda polar: polar[2],
    "azimuth^2": lambda polar: polar[1] ** 2,
    "azimuth elevation": lambda polar: polar[1] * polar[2],
    "elevation^2": lambda polar: polar[2] ** 2,
    "azimuth^3": lambda polar: polar[1] ** 3,
}
"""Up to the third power, in which a sine that is taken for its angle differs from it [rad]."""
_OF_RADAR, _OF_CLICKS, _OF_LENS = ("range", "azimuth", "elevation"), ("column", "row"), ("focal length", "distortion")
_PRIORS: Mapping[tuple[str, str], str] = {
    ("range", ""): "range_bias_m",
    ("range", "range"): "range_scale",
    ("azimuth", "azimuth"): "azimuth_scale",
    ("elevation", "elevation"): "elevation_scale",
    ("elevation", "azimuth"): "elevation_lean",
    ("column", ""): "click_right_px",
    ("row", ""): "click_down_px",
}
"""The systematic errors, whose priors the options state, that are causes too if the pairs put them beyond these."""
_ABSORBED = {("azimuth", ""), ("elevation", "")}  # by the rotation


@dataclass(frozen=True, slots=True, eq=False)
class Cause:
    """One row of the table, as it is for these pairs.

    Attributes:
        quantity: "range", "azimuth", "elevation", "column", "row", "focal length", "distortion"; of a step "turn", "move" or
            "range step".
        shape: a key of the shapes, or "time"; empty for a constant and for steps.
        columns: (n, 2, k) d whitened pixel / d cause, of the inliers in order of time.
        largest: the factor at the placement where the cause does most.
        split: of a step, how many placements are before it; else 0.
    """

    quantity: str
    shape: str
    columns: np.ndarray
    largest: float = 1.0
    split: int = 0

    @property
    def kind(self) -> str:
        """A key of the shares of the level."""
        if self.split:
            return self.quantity
        return "stated" if self.quantity in _OF_LENS or (self.quantity, self.shape) in _PRIORS else "other"


@dataclass(frozen=True, slots=True)
class Tested:
    """A cause with its estimate (k,), standard deviations (k,), statistic and probability of one as large in a sound set."""

    cause: Cause
    amount: tuple[float, ...]
    sigma: tuple[float, ...]
    statistic: float
    chance: float

    @property
    def penalized(self) -> float:
        """The statistic less what the cause costs: its unknowns, its size beside that of such errors (Cauchy), its shape."""
        size = float(np.linalg.norm(self.amount)) * self.cause.largest / _PLAUSIBLE[self.cause.quantity]
        cost = _COST * len(self.amount) + 2.0 * float(np.log1p(size**2))
        return self.statistic - cost - (_UNUSUAL if self.cause.kind == "other" else 0.0)


def causes(fit: SolvedFit) -> list[DataWarning]:
    """Name the likeliest cause, with those it cannot be told from; nothing if none is significant."""
    if fit.inliers.sum() < _LEAST_PAIRS or fit.measurements.flat:
        return []
    tested = tested_causes(fit)
    if not any(test.chance < LEVEL for test in tested):
        return []
    best = max(tested, key=lambda test: test.penalized)
    beside = [test for test in tested if not test.cause.split and test.penalized > best.penalized - _BESIDE]
    beside = sorted((test for test in beside if test is not best), key=lambda test: -test.penalized)
    return [_warning(fit, best, [] if best.cause.split else beside)]


def tested_causes(fit: SolvedFit) -> list[Tested]:
    """Test every cause; the chances are those among all of them."""
    order = _order(fit)
    null = _Null.of(fit, order)
    alike: dict[tuple[bool, int], list[Cause]] = {}
    for cause in (*_constant_causes(fit, order), *_steps(fit, order)):
        alike.setdefault((cause.split > 0, cause.columns.shape[2]), []).append(cause)
    kinds: dict[str, list[Tested]] = {}
    for (is_step, _), several in alike.items():
        for tested in null.tests(several, _SMOOTH_VARIANCE_OF_STEPS if is_step else _SMOOTH_VARIANCE):
            kinds.setdefault(tested.cause.kind, []).append(tested)
    return [
        replace(test, chance=min(1.0, max(1.0, _DIFFERENT * len(tests)) * test.chance / _SHARES[kind]))
        for kind, tests in kinds.items()
        for test in tests
    ]


@dataclass(frozen=True, slots=True, eq=False)
class _Null:
    """What is known of the residuals without any cause.

    Attributes:
        residual: (m,) of the inliers and the priors, whitened and weighted.
        explained: (m, u) orthonormal columns of what pose and estimated errors can explain.
        uncertain: (m, w) columns of the widening errors, each of one standard deviation.
        smooth: (n, 2, c) square root of the covariance of smooth angle errors as large as the noise.
        root: (n,) of the weights.
        freedom: degrees of freedom of the noise; 0 if it was not estimated.
    """

    residual: Values
    explained: np.ndarray
    uncertain: np.ndarray
    smooth: np.ndarray
    root: Values
    freedom: float

    @classmethod
    def of(cls, fit: SolvedFit, order: Indices) -> "_Null":
        """Gather it from a fit, for the inliers in an order."""
        refined = fit.refined
        residual, jacobian = weighted_rows(refined, order)
        priors, prior_jacobian = prior_rows(refined.measurements, refined.camera_from_radar)
        root = np.sqrt(refined.weights[order])
        widening = widening_rows(refined)[order] * root[:, None, None]
        sigma = np.array([error.sigma for error in refined.measurements.errors.widening])
        uncertain = np.zeros((len(residual) + len(priors), len(sigma)))
        uncertain[: len(residual)] = (widening * sigma).reshape(len(residual), -1)
        return cls(
            np.concatenate([residual, priors]),
            np.linalg.qr(np.concatenate([jacobian, prior_jacobian]))[0],
            uncertain,
            smooth_rows(refined, order, float(_SMOOTH_RAD)).reshape(len(order), 2, -1),
            root,
            refined.degrees_of_freedom,
        )

    def tests(self, causes: Sequence[Cause], smooth_variance: float) -> list[Tested]:
        """Estimate causes of as many unknowns each; those of which pose and estimated errors leave nothing are left out."""
        count, width = len(self.root), causes[0].columns.shape[2]
        gain = np.zeros((len(causes), len(self.residual), width))
        columns = np.array([cause.columns for cause in causes]) * self.root[:, None, None]
        gain[:, : 2 * count] = columns.reshape(len(causes), 2 * count, width)
        whole = np.linalg.norm(gain, axis=1)
        gain = gain - self.explained @ (self.explained.T @ gain)
        kept = (np.linalg.norm(gain, axis=1) > _LEAST_OWN * whole).all(axis=1)
        if not kept.any():
            return []
        axes, triangle = np.linalg.qr(gain[kept])
        across = np.swapaxes(axes, 1, 2)
        score = across @ self.residual
        left = np.maximum(self.freedom - (score**2).sum(axis=1), _LEAST_LEFT * self.freedom)
        noise = left / (self.freedom - width) if self.freedom > width + 1.0 else np.ones(len(left))
        known = across @ self.uncertain
        each = np.einsum(
            "tnrk,nrs->tnks", axes[:, : 2 * count].reshape(-1, count, 2, width), self.smooth, optimize=True
        )
        shared, own = each.sum(axis=1), np.swapaxes(each, 2, 3)
        added, turned = np.linalg.eigh(shared @ np.swapaxes(shared, 1, 2) - (each @ own).sum(axis=1))
        smooth = (turned * np.maximum(added, 0.0)[:, None]) @ np.swapaxes(turned, 1, 2)
        variance = noise[:, None, None] * np.eye(width) + known @ np.swapaxes(known, 1, 2) + smooth_variance * smooth
        statistic = (score * np.linalg.solve(variance, score[:, :, None])[:, :, 0]).sum(axis=1)
        back = np.linalg.inv(triangle)
        amount = (back @ score[:, :, None])[:, :, 0]
        sigma = np.sqrt(np.diagonal(back @ variance @ np.swapaxes(back, 1, 2), axis1=1, axis2=2))
        return [
            Tested(
                causes[k], tuple(a.tolist()), tuple(s.tolist()), float(t), _chance(float(t), self.freedom, float(width))
            )
            for k, a, s, t in zip(np.flatnonzero(kept).tolist(), amount, sigma, statistic, strict=True)
        ]


_LEAST_OWN = 1e-6  # share of a column that is left beside pose and estimated errors; less may be rounding


def _chance(statistic: float, freedom: float, count: float) -> float:
    from scipy.special import chdtrc, fdtrc

    return float(
        fdtrc(count, freedom - count, statistic / count) if freedom > count + 1.0 else chdtrc(count, statistic)
    )


def _constant_causes(fit: SolvedFit, order: Indices) -> Iterator[Cause]:
    refined = fit.refined
    polar, whitening = refined.polar[:, order], refined.model.whitening[order]
    columns = {name: refined.model.point_jacobian[order][:, :, axis] for axis, name in enumerate(_OF_RADAR)} | {
        name: whitening[:, :, axis] for axis, name in enumerate(_OF_CLICKS)
    }
    timed = {"time": np.linspace(-0.5, 0.5, len(order))} if _is_timed(fit) else {}
    factors = {name: shape(polar) for name, shape in _SHAPES.items()} | timed
    for quantity in columns:
        for shape, factor in factors.items():
            if (quantity, shape) not in _ABSORBED:
                factor = polar[0] if quantity == shape == "range" else factor  # the range's scale itself
                largest = float(factor[np.abs(factor).argmax()])
                yield Cause(quantity, shape, (columns[quantity] * factor[:, None])[:, :, None], largest)
    camera = fit.measurements.camera
    offset_px = fit.measurements.pixels_px[order] - camera.matrix_px[:2, 2]
    share = ((offset_px / camera.matrix_px[[0, 1], [0, 1]]) ** 2).sum(axis=1)
    yield Cause("focal length", "", whitening @ offset_px[:, :, None])
    reach_px = float((share * np.linalg.norm(offset_px, axis=1)).max())
    yield Cause("distortion", "", whitening @ (offset_px * share[:, None])[:, :, None], reach_px)


def _steps(fit: SolvedFit, order: Indices) -> Iterator[Cause]:
    """Yield what may happen between two placements in time."""
    times, count = _times(fit)[order], len(order)
    model = fit.refined.model
    of_pose = model.jacobian[order][:, :, :6]
    kinds = {
        "turn": of_pose[:, :, 3:],
        "move": of_pose[:, :, :3],
        "range step": model.point_jacobian[order][:, :, :1],
    }
    tried = np.linspace(_LEAST_PLACEMENTS, count - _LEAST_PLACEMENTS, _MOST_SPLITS).round().astype(np.int64)
    for split in np.unique(tried).tolist():
        if 0 < split < count and 0 < times[split - 1] < times[split]:
            after = (np.arange(count) >= split)[:, None, None]
            yield from (Cause(kind, "", columns * after, split=split) for kind, columns in kinds.items())


def _order(fit: SolvedFit) -> Indices:
    """Return the inliers in order of time."""
    inliers = np.flatnonzero(fit.inliers)
    return np.asarray(inliers[np.argsort(_times(fit)[inliers], kind="stable")])


def _is_timed(fit: SolvedFit) -> bool:
    return any(time is not None for time in fit.times)


def _times(fit: SolvedFit) -> np.ndarray:
    """Return the times (n,) of the pairs, 0 where unknown; of pairs without any the numbers at the end of their ids, unless these
    follow a column: pairs sorted by range are in no order of time."""
    if _is_timed(fit):
        return np.array([time or 0 for time in fit.times], dtype=np.int64)
    ends = [re.search(r"(\d{1,9})$", name) for name in fit.ids]
    numbers = np.array([int(end[1]) if end else 0 for end in ends], dtype=np.int64)
    columns = np.column_stack([fit.refined.polar.T, fit.measurements.pixels_px, fit.measurements.rays])
    steps = np.diff(columns[np.argsort(numbers, kind="stable")], axis=0)
    is_sorted = ((steps >= 0.0).all(axis=0) | (steps <= 0.0).all(axis=0)).any()
    return np.zeros_like(numbers) if is_sorted else numbers


def _warning(fit: SolvedFit, test: Tested, beside: Sequence[Tested]) -> DataWarning:
    cause = test.cause
    if cause.split:
        return DataWarning("shared-error-suspected", _step_facts(fit, test))
    others = {"beside": [(one.cause.quantity, one.cause.shape) for one in beside[:_MOST_BESIDE]]}
    amount, sigma = test.amount[0], test.sigma[0]
    if cause.quantity == "focal length":
        return DataWarning("intrinsics-suspected", {"focal_length": amount, "sigma": sigma} | others)
    if cause.quantity == "distortion":
        size_px = {"distortion_px": abs(amount) * cause.largest, "sigma": sigma * cause.largest}
        return DataWarning("intrinsics-suspected", size_px | others)
    if cause.quantity in _OF_RADAR:  # what is reported too large makes the residuals smaller
        amount = -amount
    prior = _PRIORS.get((cause.quantity, cause.shape))
    errors = [error for error in fit.uncertainty.systematic_errors if error.name == prior]
    if errors:
        facts = {"error": errors[0].name, "value": amount, "sigma": sigma, "prior_sigma": errors[0].prior_sigma}
        return DataWarning("shared-error-suspected", facts | others)
    facts = {
        "quantity": cause.quantity,
        "shape": cause.shape,
        "largest": amount * cause.largest,
        "largest_sigma": sigma * abs(cause.largest),
    }
    return DataWarning("shared-error-suspected", facts | others)


_MOST_BESIDE = 2  # other causes that are said


def _step_facts(fit: SolvedFit, test: Tested) -> Facts:
    order, split = _order(fit), test.cause.split
    return {
        "step": test.cause.quantity,
        "size": float(np.linalg.norm(test.amount)),
        "before": fit.ids[order[split - 1]],
        "after": fit.ids[order[split]],
        "by_number": not _is_timed(fit),
    }
