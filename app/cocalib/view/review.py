"""What the review of all pairs shows beyond their rows: influence, held-out distance, and how long residuals should be."""

from dataclasses import dataclass

import msgspec
import numpy as np

from calib_core.arrays import Values
from calib_core.diagnostics.residual_distribution import expected_shares
from calib_core.results import Calibration
from cocalib.view.number_format import plain

_CHI2_95_2D = 5.991464547107979
_FEWEST_BINS, _MOST_BINS = 8, 24
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


class ReviewRow(msgspec.Struct, frozen=True, array_like=True):
    """What a review shows of one pair beyond its row; written as an array.

    Attributes:
        id: the click's id.
        influence: how far leaving it out moves the pose, in standard deviations; None if unknown.
        held_out_px: distance from the click to where the other pairs predict it; None if unknown.
        sigmas: length of the residual over what the noise model expects in its direction; None without a noise model.
    """

    id: str
    influence: float | None
    held_out_px: float | None
    sigmas: float | None


@dataclass(frozen=True, slots=True)
class ResidualHistogram:
    """The bins of a histogram of residual lengths.

    Attributes:
        edges_px: of the bins, ascending; longer residuals belong to one more bin after the last.
        expected: share of the agreeing pairs in each bin according to the noise model; empty without one.
    """

    edges_px: tuple[float, ...]
    expected: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Review:
    """The review of all pairs of an answer.

    Attributes:
        revision: of the session that the answer belongs to.
        rows: one per pair with a radar position.
        histogram: of the residuals' lengths; None without pairs.
        words: how the residuals compare with the noise model, and which pair the pose leans on most.
    """

    revision: int
    rows: tuple[ReviewRow, ...]
    histogram: ResidualHistogram | None
    words: str


def review_of(calibration: Calibration | None, revision: int) -> Review:
    """Return the review of an answer; an empty one without a calibration."""
    if calibration is None or not calibration.pairs:
        return Review(revision, (), None, "Available after the first calibration.")
    rows = tuple(
        ReviewRow(pair.id, _rounded(pair.influence, 3), _rounded(pair.held_out_px, 2), _rounded(sigmas, 3))
        for pair, sigmas in zip(calibration.pairs, _sigmas(calibration).tolist(), strict=True)
    )
    return Review(revision, rows, _histogram(calibration), _words(calibration))


def _rounded(value: float, digits: int) -> float | None:
    return round(value, digits) if np.isfinite(value) else None


def _sigmas(calibration: Calibration) -> Values:
    """Return the Mahalanobis length (n,) of each residual; NaN where it is unknown."""
    residuals = np.array([pair.residual_px for pair in calibration.pairs])
    covariances = np.array([pair.expected_covariance_px2 for pair in calibration.pairs])
    known = np.isfinite(residuals).all(axis=1) & np.isfinite(covariances).all(axis=(1, 2))
    sigmas = np.full(len(residuals), np.nan)
    whitened = np.linalg.solve(covariances[known], residuals[known][:, :, None])[:, :, 0]
    sigmas[known] = np.sqrt((whitened * residuals[known]).sum(axis=1))
    return sigmas


def _histogram(calibration: Calibration) -> ResidualHistogram | None:
    agreeing = [pair for pair in calibration.pairs if pair.inlier and np.isfinite(pair.distance_px)]
    if not agreeing:
        return None
    edges_px = _edges(np.array([pair.distance_px for pair in agreeing]))
    covariances = np.array([pair.expected_covariance_px2 for pair in agreeing])
    if not np.isfinite(covariances).all():
        return ResidualHistogram(tuple(edges_px.tolist()), ())
    shares = expected_shares(covariances, edges_px)
    return ResidualHistogram(tuple(edges_px.tolist()), tuple(np.round(shares, 5).tolist()))


def _edges(distances_px: Values) -> Values:
    """Return edges at round numbers from 0 to beyond the longest, with about sqrt(n) bins, and at least eight."""
    wanted = float(np.clip(2.0 * np.sqrt(len(distances_px)), _FEWEST_BINS, _MOST_BINS))
    longest_px = max(float(distances_px.max()), 1e-3)
    power = 10.0 ** np.floor(np.log10(longest_px / wanted))
    width_px = next(step * power for step in _STEPS if longest_px / (step * power) <= wanted)
    return np.asarray(np.arange(np.ceil(longest_px / width_px) + 1) * width_px)


def _words(calibration: Calibration) -> str:
    agreeing = np.array([pair.inlier for pair in calibration.pairs])
    sigmas = _sigmas(calibration)[agreeing]
    sigmas = sigmas[np.isfinite(sigmas)]
    said = ["This method has no noise model: no distribution is expected."]
    if len(sigmas):
        inside = int((sigmas**2 <= _CHI2_95_2D).sum())
        said = [
            f"{inside} of {len(sigmas)} agreeing pairs are inside their 95 % ellipse ({plain(0.95 * len(sigmas))} expected)."
        ]
    influences = [(pair.influence, pair.id) for pair in calibration.pairs if np.isfinite(pair.influence)]
    if influences:
        most, name = max(influences)
        said.append(f"The pose leans most on {name}: leaving it out moves it by {plain(most, 2)} standard deviations.")
    return " ".join(said)
