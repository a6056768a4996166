"""All that the checks of a calibration look at, in one value."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.arrays import Flags
from calib_core.estimation.consensus import Consensus
from calib_core.estimation.doubting import Doubt
from calib_core.estimation.evidence import Evidence
from calib_core.estimation.refining import Refined
from calib_core.estimation.uncertainty import LeftOut, PoseUncertainty

__all__ = ["Findings"]


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """All that the checks look at.

    Attributes:
        ids: of the used pairs, in the order of the evidence.
        evidence: with the noise as assumed.
        refined: the fit.
        uncertainty: of its pose.
        left_out: leave-one-out.
        doubts: the pairs that the others contradict.
        inliers: (n,) which pairs took part.
        alternatives: where the other starts ended, the most likely first.
        mirror_gain: by how much mirrored radar axes explain the pairs better; negative: worse.
        chi2_per_degree: by the noise as assumed.
    """

    ids: tuple[str, ...]
    evidence: Evidence
    refined: Refined
    uncertainty: PoseUncertainty
    left_out: LeftOut
    doubts: Sequence[Doubt]
    inliers: Flags
    alternatives: Sequence[Consensus]
    mirror_gain: float
    chi2_per_degree: float
