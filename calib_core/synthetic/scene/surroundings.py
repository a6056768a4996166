"""What stands in a scene besides the reflector: parked cars, a fence, a strong target, the cart behind each placement."""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Points3, Vector3
from calib_core.errors import OptionError
from calib_core.synthetic.options import Surroundings
from calib_core.synthetic.scene.scenes import Box, Scatterer, Scene, post

_CAR_M = (4.4, 1.8)
_CAR_DBSM = (20.0, 14.0, 11.0)
"""Of a car's near corner, its side and its far wheel."""
_CAR_CLEARANCE_M = 1.2
_FENCE_M = (7.5, 5.0, 21.0)
"""Distance from the radar's axis, begin and end of the fence."""
_POST_DBSM = 8.0
_CART_HEIGHT_M, _CART_BEHIND_M = 0.5, 1.0
_FLICKER = ((0.2, 1.5), (6.0, 14.0), (8.0, 30.0), (0.2, 0.6), (0.0, 1.0))
"""Height [m], radar cross-section [dBsm], period [s], share of it and phase of a target that comes and goes."""


@dataclass(frozen=True, slots=True)
class Flicker:
    """A static target that the radar sees for a share of each period [s], from a phase (0 to 1) on."""

    scatterer: Scatterer
    period_s: float
    share: float
    phase: float

    def shows(self, time_s: float) -> bool:
        """Return whether the radar sees it at a time of the story."""
        return (time_s / self.period_s + self.phase) % 1.0 < self.share


def draw_flickers(rng: np.random.Generator, count: int, scene: Scene) -> tuple[Flicker, ...]:
    """Draw targets that come and go, among the placements and a little beyond."""
    layout, found = scene.layout, []
    spans = np.array([(3.0, layout.max_range_m + 2.0), (-1.0, 1.0), *_FLICKER])
    for _ in range(count):
        range_m, aside, z_m, rcs_dbsm, *rhythm = rng.uniform(*spans.T).tolist()
        azimuth_rad = aside * min(np.deg2rad(layout.max_azimuth_deg), layout.max_lateral_m / range_m)
        x_m, y_m = float(range_m * np.cos(azimuth_rad)), float(range_m * np.sin(azimuth_rad))
        found.append(Flicker(Scatterer((x_m, y_m, z_m), rcs_dbsm), *rhythm))
    return tuple(found)


def furnished(rng: np.random.Generator, scene: Scene, surroundings: Surroundings) -> tuple[Scene, Scene]:
    """Add what the options ask for; return the scene with it, and a scene with only the added solids.

    Args:
        rng: the only source of randomness.
        scene: to add to.
        surroundings: what to add.

    Raises:
        OptionError: the parked cars do not fit in the scene.
    """
    solids: list[Box] = []
    scatterers: list[Scatterer] = []
    if surroundings.fence:
        side = 1.0 if rng.uniform() < 0.5 else -1.0
        solids += _fence(side)
        scatterers += [Scatterer((solid.x_m, solid.y_m, 0.6), _POST_DBSM) for solid in solids if solid.is_round]
    for _ in range(surroundings.parked_cars):
        parts, echoes = _car(rng, replace(scene, solids=(*scene.solids, *solids)))
        solids += parts
        scatterers += echoes
    if surroundings.strong_target_dbsm is not None:
        x_m = float(rng.uniform(0.5, 0.8)) * scene.layout.max_range_m
        y_m = float(rng.choice([-1.0, 1.0])) * min(0.45 * x_m, scene.layout.max_lateral_m + 0.9)
        solids.append(post(x_m, y_m, 0.05, 1.6, "metal"))
        scatterers.append(Scatterer((x_m, y_m, 0.8), surroundings.strong_target_dbsm))
    if not solids:
        return scene, replace(scene, solids=())
    whole = replace(scene, solids=(*scene.solids, *solids), scatterers=(*scene.scatterers, *scatterers))
    return whole, replace(scene, solids=tuple(solids))


def _fence(side: float) -> list[Box]:
    aside_m, begin_m, end_m = _FENCE_M
    posts = [post(float(x), side * aside_m, 0.05, 1.2, "metal") for x in np.arange(begin_m, end_m, 2.0)]
    middle_m, length_m = 0.5 * (begin_m + end_m), end_m - begin_m
    rails = [Box(middle_m, side * aside_m, length_m, 0.04, 0.08, "metal", base_m=base) for base in (0.5, 1.05)]
    return [*posts, *rails]


def _car(rng: np.random.Generator, scene: Scene) -> tuple[list[Box], list[Scatterer]]:
    """Park a car at one side: clear of what is there, and off the middle, where the placements are."""
    length_m, width_m = _CAR_M
    for _ in range(500):
        x_m, side = float(rng.uniform(6.0, scene.layout.max_range_m + 4.0)), float(rng.choice([-1.0, 1.0]))
        y_m = side * float(rng.uniform(0.42 * x_m, 0.42 * x_m + 3.0))
        ends = [np.array([x_m + share * length_m, y_m]) for share in (-0.5, -0.25, 0.0, 0.25, 0.5)]
        if all(scene.free(end, 0.5 * width_m + _CAR_CLEARANCE_M) for end in ends):
            break
    else:
        raise OptionError(f"the parked cars do not fit in the {scene.name}: ask for fewer")
    colour = rng.choice(["blue", "white", "dark"])
    parts = [
        Box(x_m, y_m, 0.8 * length_m, 0.9 * width_m, 0.25, "dark"),
        Box(x_m, y_m, length_m, width_m, 0.65, colour, base_m=0.25),
        Box(x_m + 0.2, y_m, 0.5 * length_m, 0.85 * width_m, 0.55, "dark", base_m=0.9),
    ]
    near_m, inner_m = x_m - 0.5 * length_m, y_m - side * 0.5 * width_m
    places = ((near_m, inner_m, 0.6), (x_m, inner_m, 0.7), (x_m + 0.35 * length_m, inner_m, 0.35))
    echoes = [Scatterer(place, rcs) for place, rcs in zip(places, _CAR_DBSM, strict=True)]
    return parts, echoes


def in_sight(added: Scene, places_m: Points3) -> Flags:
    """Return which places (n, 3) on the ground none of the added solids hides from the sensors above the origin."""
    steps = np.linspace(0.05, 0.97, 60)
    return np.array([all(added.free(step * place[:2], 0.2) for step in steps) for place in places_m], dtype=np.bool_)


def cart_position(apex_m: Vector3) -> Vector3:
    """Return where the cart's echo is for a reflector: straight behind it as seen from the radar."""
    away = apex_m[:2] / max(float(np.linalg.norm(apex_m[:2])), 1e-9)
    place = apex_m[:2] + _CART_BEHIND_M * away
    return np.array([place[0], place[1], _CART_HEIGHT_M])
