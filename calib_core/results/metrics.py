"""The paper's metrics (AED, CDSD, Acc), plus RMS and the held-out AED.

They measure pixels, not the accuracy of the pose: a worse pose can have a smaller AED (docs/paper.md). To judge a pose,
use its covariance and the held-out AED.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from calib_core.arrays import Flags, Points2, Values
from calib_core.results.calibration import Metrics

ZeroFrames = Literal["keep", "drop"]


def distances(projected_px: Points2, pixels_px: Points2) -> Values:
    """Return e_i = |projected_i - clicked_i| for each pair: (n,) [px] (paper: the distance that AED averages)."""
    return np.asarray(np.linalg.norm(np.asarray(projected_px) - np.asarray(pixels_px), axis=1), dtype=np.float64)


def aed(distances_px: Values) -> float:
    """Average the Euclidean distances: AED = (1 / N) sum e_i [px] (paper, AED: divided by N). NaN without pairs.

    Args:
        distances_px: (n,) lengths of the reprojection errors.
    """
    values = np.asarray(distances_px, dtype=np.float64)
    return float(values.sum() / len(values)) if len(values) else float("nan")


def cdsd(distances_px: Values) -> float:
    """Return the corrected standard deviation of the distances: CDSD = sqrt(sum (e_i - AED)^2 / (N - 1)) [px].

    Paper, CDSD: divided by N - 1, hence "corrected". NaN below two pairs.

    Args:
        distances_px: (n,) lengths of the reprojection errors.
    """
    values = np.asarray(distances_px, dtype=np.float64)
    if len(values) < 2:
        return float("nan")
    return float(np.sqrt(np.square(values - aed(values)).sum() / (len(values) - 1)))


def rms(distances_px: Values) -> float:
    """Return the root mean square distance, sqrt(sum e_i^2 / N) [px]; not in the paper. NaN without pairs.

    Args:
        distances_px: (n,) lengths of the reprojection errors.
    """
    values = np.asarray(distances_px, dtype=np.float64)
    return float(np.sqrt(np.square(values).sum() / len(values))) if len(values) else float("nan")


def acc(inside: Sequence[Flags], *, zero_frames: ZeroFrames = "keep") -> float | None:
    """Return the share of reprojected radar returns that fall within detection boxes, averaged over frames (paper, Acc).

    Acc = (1 / F) sum over frames of (returns inside a box) / (returns). A frame without returns has no share and does not
    count in F. The authors' script also drops the frames whose share is 0 before averaging, which can only raise the figure: a
    calibration that misses half of the frames entirely would still score 100 %. Zero frames are kept by default.

    Args:
        inside: per frame, (n,) which returns lie in a box.
        zero_frames: "keep" them, or "drop" them to compare with the published figures.

    Returns:
        0 to 1, or None if no frame counts.
    """
    shares = [float(np.mean(flags)) for flags in inside if len(flags)]
    if zero_frames == "drop":
        shares = [share for share in shares if share > 0.0]
    return float(np.mean(shares)) if shares else None


def metrics_of(
    distances_px: Values,
    *,
    held_out_distances_px: Values | None = None,
    acc: float | None = None,
    chi2: float = float("nan"),
    degrees_of_freedom: int = 0,
) -> Metrics:
    """Compute the metrics of one set of pairs.

    Args:
        distances_px: (n,) lengths of the reprojection errors of the pairs included.
        held_out_distances_px: (m,) the same with each pair predicted from the others; None if not computed.
        acc: the paper's Acc, 0 to 1; None without boxes.
        chi2: sum of squared whitened residuals; NaN if the method has no noise model.
        degrees_of_freedom: of chi2.
    """
    return Metrics(
        aed_px=aed(distances_px),
        cdsd_px=cdsd(distances_px),
        rms_px=rms(distances_px),
        n=len(distances_px),
        held_out_aed_px=float("nan") if held_out_distances_px is None else aed(held_out_distances_px),
        acc=acc,
        chi2=chi2,
        degrees_of_freedom=degrees_of_freedom,
    )
