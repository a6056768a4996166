"""With intrinsics that are off: does the stated uncertainty hold, and what does refining them gain?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.figures import Measured, at_most, column, low, ratio, rmse, share, tally, within
from benchmarks.accuracy.outcomes import inside, misleading, outcome_figures, silently_wrong, sold
from benchmarks.accuracy.rows import Figures, Kept, Row, Section
from benchmarks.simulated_pairs import NoiseName, SimulatedPairs, draw_systematic_errors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera, CameraCovariance
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions, LensOptions, RadarOptions, RefiningOptions

_TRIALS = 24
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
        for noise in ("imaging",)
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
    """Judge each row."""
    rows, covered, harmless, focal_off, outside = [], [], [], [], []
    for case in _CASES:
        trials = kept.get(case.key, ())
        if len(trials) < 2:
            continue
        name = case.key.removeprefix("lens-").replace("-", " ")
        focal, sigma = column(trials, "focal"), column(trials, "focal_sigma")
        held = share(inside(trials))
        of_focal = share(np.where(np.isfinite(sigma), np.abs(focal) <= 1.96 * sigma, np.nan))
        shares = (held, of_focal) if case.refined else (held,)
        covered += [(name, f"{one.value:.0f} %", within(one, 93.0, 97.0)) for one in shares]
        outside += [f"lens: {name} ({held.value:.0f} %)"] if low(held) else []
        over = _over_given(case, trials, kept)
        harmless += [(name, f"{one.value:.3f}", at_most(one, 1.0)) for one in over]
        off = ratio(focal, np.full(len(focal), _FOCAL_AIM))
        if case.refined and case.alone:
            focal_off.append((name, f"{100.0 * _FOCAL_AIM * off.value:.2f} %", at_most(off, 1.0)))
        relied = sold(trials)
        rows.append(
            {"row": name, "sets": str(len(trials)), "inside 95 %": held.percent, "aim": "93 to 97 %"}
            | {"verdict": within(held, 93.0, 97.0), "focal length inside": of_focal.percent if case.refined else "-"}
            | {"rotation [deg]": f"{np.rad2deg(rmse(trials, 'rotation_rad')):.2f}"}
            | {"position [cm]": f"{100.0 * rmse(trials, 'position_m'):.1f}"}
            | {"over as given": " / ".join(map(str, over)), "aim over": "1" if over else "-"}
            | {"over": " / ".join(at_most(one, 1.0) for one in over)}
            | {"focal length, rms": f"{100.0 * rmse(trials, 'focal'):.2f} %"}
            | {"good or usable": str(int(relied.sum()))}
            | {"silent": str(int((silently_wrong(trials, _CODES) & relied).sum()))}
            | {"misleading": str(int(misleading(trials, _CODES).sum()))}
        )
    claims = (
        tally("truth inside the stated 95 % in 93 to 97 %, of pose and refined focal length", covered),
        tally("refining makes rotation and position no worse", harmless),
        tally("nothing but the focal length off, angle scale told: below 0.3 % (rms) once refined", focal_off),
    )
    return Section("Intrinsics that are off: does refining them help?", _TEXT, claims, tuple(rows), tuple(outside))


_CODES = ("intrinsics-suspected", "lens-or-radar-scale", "angle-scale")


def _over_given(case: WrongLens, trials: Sequence[Figures], kept: Kept) -> list[Measured]:
    """Return the RMSE of rotation and position over that of the same sets with the intrinsics as given."""
    given = kept.get(replace(case, refined=False).key, ()) if case.refined else ()
    if len(given) < 2:
        return []
    names = ("rotation_rad", "position_m")
    return [ratio(column(trials, name)[: len(given)], column(given, name)[: len(trials)]) for name in names]


_TEXT = """20 pairs, none wrong, with the other errors that all pairs share. The lens is off as a covariance of a good board
calibration says (0.1 % of the focal length, 1.5 px of the principal point), or six times that; by the priors of `--refining.*`
(3 %, 10 px); or by 2 % of the focal length."""
