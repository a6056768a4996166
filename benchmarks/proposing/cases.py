"""What is recorded: every seed names one case, and any 24 seeds in a row have every scene with both radars and all clutter."""

from dataclasses import dataclass

import numpy as np

from calib_core.synthetic.options import Clutter, RadarName, SceneName, SimulationOptions, Surroundings

__all__ = ["Case", "case_of"]

_SCENES: tuple[SceneName, ...] = ("field", "aisle", "rooftop", "checkerboard")
_RADARS: tuple[RadarName, ...] = ("awr1843", "imaging")
_CLUTTER: tuple[Clutter, ...] = ("none", "scene", "heavy")
_STREAM = 15


@dataclass(frozen=True, slots=True)
class Case:
    """A recording to be simulated.

    Attributes:
        options: of the simulation, with the seed.
        light: whether the light changes while it is recorded.
    """

    options: SimulationOptions
    light: bool = False

    @property
    def name(self) -> str:
        """Its scene and seed, usable as the name of a folder."""
        return f"{self.options.scene}-{self.options.seed}"

    @property
    def traits(self) -> tuple[str, ...]:
        """What is special about it, in words of the table."""
        options = self.options
        found = [options.scene, f"radar {options.radar}", f"clutter {options.clutter}"]
        found += ["light changes"] if self.light else []
        found += ["passers-by"] if options.surroundings.passers_by else []
        found += ["two reflectors"] if options.reflectors == 2 else []
        found += ["tripod"] if options.heights else []
        return tuple(found)


def case_of(seed: int) -> Case:
    """Draw the case of a seed, which is that of its recording too."""
    rng = np.random.default_rng([seed, _STREAM])
    chance = rng.random(5)
    options = SimulationOptions(
        scene=_SCENES[seed % 4],
        radar=_RADARS[seed // 4 % 2],
        clutter=_CLUTTER[seed // 8 % 3],
        placements=2 * int(rng.integers(5, 8)),
        dwell_s=round(float(rng.uniform(4.5, 6.5)), 1),
        heights=bool(chance[0] < 0.25),
        reflectors=2 if chance[1] < 0.2 else 1,
        surroundings=Surroundings(passers_by=4 if chance[2] < 0.3 else 0),
        sensor_noise_grey=2.0 if chance[3] < 0.5 else 0.0,
        camera_rate_hz=2.0,
        seed=seed,
    )
    return Case(options, light=bool(chance[4] < 0.3))
