"""With intrinsics that are off: does the stated uncertainty hold, and what does refining them gain?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.figures import at_most, column, fewest, joined, ratio, share, summed_up, within
from benchmarks.accuracy.outcomes import outcome_figures
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import NoiseName, SimulatedPairs, draw_systematic_errors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera, CameraCovariance
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions, LensOptions, RadarOptions, RefiningOptions

__all__ = ["ROWS", "WrongLens", "board_covariance", "draw_wrong_lens", "measure_wrong_lens", "section"]

_TRIALS = 400
_FOCAL_AIM = 0.003

LensError = Literal["covariance", "poor covariance", "refining priors", "focal 2 %"]


@dataclass(frozen=True, slots=True)
class WrongLens:
    """How far off the lens is, and what the estimator is told."""

    lens: LensError
    refined: bool
    noise: NoiseName = "imaging"
    pairs: int = 20
    tape_m: float | None = 0.01
    scale_told: bool = False
    """Whether the radar's angle scale is exact, and the estimator knows it."""
    alone: bool = False
    """Whether nothing but the lens is off."""

    @property
    def key(self) -> str:
        """A file name."""
        words = (self.lens.replace(" %", "pc"), self.noise, str(self.pairs), "free" if self.tape_m is None else "tape")
        told = (*(("scale told",) if self.scale_told else ()), *(("alone",) if self.alone else ()))
        return "-".join(("lens", *words, *told, "refined" if self.refined else "given")).replace(" ", "-")

    @property
    def options(self) -> CalibrationOptions:
        """What the estimator is told of radar and camera position, and whether it refines."""
        scale = {"azimuth_scale_sigma": 0.0, "elevation_scale_sigma": 0.0} if self.scale_told else {}
        return CalibrationOptions(
            radar=RadarOptions(**scale),
            solving=tape_measured(self.tape_m),
            refining=RefiningOptions(intrinsics=self.refined),
        )


_CASES = (
    *(
        WrongLens(lens, refined, noise, 20, tape_m)
        for lens in ("covariance", "poor covariance")
        for noise in ("imaging", "ti")
        for tape_m in (0.01, None)
        for refined in (False, True)
    ),
    *(
        WrongLens("refining priors", refined, "imaging", 20, tape_m)
        for tape_m in (0.01, None)
        for refined in (False, True)
    ),
    *(WrongLens("focal 2 %", refined, scale_told=True, alone=True) for refined in (False, True)),
    *(WrongLens("focal 2 %", refined, scale_told=told) for told in (True, False) for refined in (False, True)),
)


def board_covariance(camera: Camera, *, size: float = 1.0) -> CameraCovariance:
    """Return the covariance of a camera's intrinsics as boards leave it: focal lengths tied, distortion against both.

    Args:
        camera: with two focal lengths, a principal point and k1, k2, p1, p2.
        size: factor on the standard deviations; 1 is a good calibration, of 0.1 % of the focal length.
    """
    focal_px = float(camera.matrix_px[0, 0])
    sigma = size * np.array([1e-3 * focal_px, 1e-3 * focal_px, 1.5, 1.5, 0.003, 0.008, 2e-4, 2e-4])
    correlation = np.eye(8)
    for one, other, amount in ((0, 1, 0.95), (0, 4, -0.4), (1, 4, -0.4), (4, 5, -0.85), (2, 7, -0.6), (3, 6, -0.6)):
        correlation[one, other] = correlation[other, one] = amount
    return CameraCovariance(camera.parameter_names[:8], correlation * np.outer(sigma, sigma))


def draw_wrong_lens(case: WrongLens, trial: int) -> tuple[SimulatedPairs, Camera]:
    """Draw pairs with every shared error of the default priors but the lens's, and the intrinsics that are given."""
    rng = np.random.default_rng([2043, trial])
    drawn = draw_systematic_errors(
        np.random.default_rng([2044, trial]), radar=case.options.radar, lens=LensOptions(0.0, 0.0, 0.0)
    )
    simulated = simulate_pairs(case.pairs, rng=rng, noise=case.noise, systematic=None if case.alone else drawn)
    return simulated, _given(case, simulated.rig.camera, np.random.default_rng([2045, trial]))


def _given(case: WrongLens, true: Camera, rng: np.random.Generator) -> Camera:
    """Return the intrinsics that the estimator is given, off by what the case says."""
    if case.lens in ("covariance", "poor covariance"):
        known = board_covariance(true, size=1.0 if case.lens == "covariance" else 6.0)
        off = rng.multivariate_normal(np.zeros(len(known.order)), known.matrix)
        return true.with_parameters(true.parameters + off, known)
    parameters = true.parameters.copy()
    if case.lens == "focal 2 %":
        parameters[:2] *= 1.0 + 0.02 * rng.choice([-1.0, 1.0])
        return true.with_parameters(parameters)
    priors, width = RefiningOptions(), true.width_px / 1920.0
    parameters[:2] *= 1.0 + priors.focal_length_sigma * rng.standard_normal()
    parameters[2:4] += priors.principal_point_sigma_px * width * rng.standard_normal(2)
    parameters[4] += priors.distortion_sigma * rng.standard_normal()
    return true.with_parameters(parameters)


def measure_wrong_lens(case: WrongLens, trial: int) -> Figures:
    """Solve one trial; also say how far off the focal length of the answer is, and what is stated of it."""
    simulated, given = draw_wrong_lens(case, trial)
    outcome = calibrate_pairs(simulated.pairs, given, case.options)
    figures = outcome_figures(outcome, simulated.camera_from_radar)
    if isinstance(outcome, Unsolvable):
        return figures
    camera, focal_px = outcome.camera, float(simulated.rig.camera.matrix_px[0, 0])
    sigma_px = camera.covariance.sigma("fx_px") if camera.covariance is not None else None
    return figures | {
        "focal": float(camera.matrix_px[0, 0]) / focal_px - 1.0,
        "focal_sigma": None if sigma_px is None else sigma_px / focal_px,
    }


ROWS = tuple(Row(case.key, _TRIALS, partial(measure_wrong_lens, case)) for case in _CASES)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts = [], _Verdicts([], [], [])
    for case in _CASES:
        trials = kept.get(case.key, ())
        if len(trials) > 1:
            cells.append(_cells(case, trials, _as_given(case, kept), verdicts))
    head = (
        *("lens off by", "intrinsics", "noise", "camera position", "angle scale", "trials", "c", ""),
        *("rotation", "position", "over as given", "focal length, rms", "c of it", "cannot tell"),
    )
    claims = verdicts.claims(fewest(kept, [row.key for row in ROWS]))
    title = "With intrinsics that are off: does the stated uncertainty hold, and what does refining them gain?"
    return Section(title, _TEXT, (Part("", head, tuple(cells)),), claims)


def _as_given(case: WrongLens, kept: Kept) -> Sequence[Figures]:
    """Return the trials of the same draws with the intrinsics as given, for a case that refines them."""
    return kept.get(replace(case, refined=False).key, ()) if case.refined else ()


@dataclass(frozen=True, slots=True)
class _Verdicts:
    """Verdicts gathered row by row."""

    covered: list[str]
    harmless: list[str]
    focal: list[str]

    def claims(self, trials: str) -> tuple[Claim, ...]:
        """Return the aims."""
        return (
            summed_up(
                "lens as its covariance says, or refined: c of pose and focal length 93 to 97 %", self.covered, trials
            ),
            summed_up("a true covariance: refining makes the pose no worse", self.harmless, trials),
            summed_up(
                "nothing but the focal length off, by 2 %, angle scale told: below 0.3 % (rms) once refined",
                self.focal,
                trials,
            ),
        )


def _cells(
    case: WrongLens, trials: Sequence[Figures], given: Sequence[Figures], verdicts: _Verdicts
) -> tuple[str, ...]:
    squared, quantile = column(trials, "squared"), column(trials, "quantile")
    covered = share(np.where(np.isfinite(squared), squared <= quantile, np.nan))
    focal, sigma = column(trials, "focal"), column(trials, "focal_sigma")
    of_focal = share(np.where(np.isfinite(sigma), np.abs(focal) <= 1.96 * sigma, np.nan))
    verdict = ""
    if case.lens in ("covariance", "poor covariance") or (case.refined and case.lens == "refining priors"):
        judged = [within(covered, 93.0, 97.0), *([within(of_focal, 93.0, 97.0)] if case.refined else [])]
        verdict = joined(judged)
        verdicts.covered.extend(judged)
    over = [
        ratio(column(trials, name)[: len(given)], column(given, name)[: len(trials)])
        for name in (("rotation_rad", "position_m") if len(given) > 1 else ())
    ]
    if case.lens in ("covariance", "poor covariance"):
        verdicts.harmless.extend(at_most(one, 1.0) for one in over)
    if case.refined and case.alone:
        verdicts.focal.append(at_most(ratio(focal, np.full(len(focal), _FOCAL_AIM)), 1.0))
    rotation_deg, position_cm = (
        np.sqrt(np.nanmean(column(trials, name) ** 2)) for name in ("rotation_rad", "position_m")
    )
    untold = share(np.nan_to_num(column(trials, "code lens-or-radar-scale")))
    return (
        *(
            f"{case.lens} alone" if case.alone else case.lens,
            "refined" if case.refined else "as given",
            case.noise,
            "free" if case.tape_m is None else "1 cm",
        ),
        *("told exact" if case.scale_told else "default prior", str(len(trials)), covered.percent, verdict),
        *(f"{np.rad2deg(rotation_deg):.2f} deg", f"{100.0 * position_cm:.1f} cm", " / ".join(map(str, over))),
        *(f"{100.0 * np.sqrt(np.nanmean(focal**2)):.2f} %", of_focal.percent if case.refined else "", untold.percent),
    )


_TEXT = """The given intrinsics are off by an error that is drawn for every set, and so are the errors of radar, clicks and
reflector, from their default priors. "Covariance" is one as boards leave it (0.1 % of the focal length, 1.5 px of the principal
point, k1 and k2 tied); the camera carries it. "Poor covariance" has six times its standard deviations. "Refining priors" are
the defaults of `--refining.*` (3 %, 10 px, 0.01), nothing being carried; "focal 2 %" is that error, too long or too short, and
"alone" means that nothing else is off. `c` is the share of trials whose true pose lies inside the stated 95 % ellipsoid, "c of
it" of true focal lengths inside 1.96 stated sigma. "Over as given" is the RMSE of rotation and position over that of the same
sets without refinement. "Cannot tell" is how often the answer says `lens-or-radar-scale`. 20 pairs, field scene, none wrong."""
