"""Other objects in the radar's view do not get a placement, and advised placements determine the pose better."""

import numpy as np
import pytest

from benchmarks.accuracy.advice import measure_advice
from benchmarks.accuracy.cases import Case
from benchmarks.accuracy.clutter import SCENES, measure_clutter

_OF_SCENE = {scene.name: scene for scene in SCENES}


@pytest.mark.parametrize(
    "scene",
    [
        _OF_SCENE["field, 4 weak objects"],
        _OF_SCENE["field, 3 objects and a person"],
        _OF_SCENE["aisle, 14 objects stronger than the reflector"],
    ],
    ids=lambda scene: scene.name,
)
def test_no_placement_gets_the_position_of_something_else(scene):
    trials = [measure_clutter(scene, trial) for trial in range(2)]
    assert sum(trial["wrong"] or 0.0 for trial in trials) == 0.0
    assert sum(trial["paper_wrong"] or 0.0 for trial in trials) >= 0.8 * 40


def test_advice_shrinks_the_rotation_sigma_at_equal_numbers():
    trials = [measure_advice(Case("ti", 10, tape_m=None), trial) for trial in range(4)]
    before, after = (np.array([trial[name] for trial in trials]) for name in ("sigma_rad", "advised_sigma_rad"))
    assert np.sqrt((before**2).mean() / (after**2).mean()) > 1.2
