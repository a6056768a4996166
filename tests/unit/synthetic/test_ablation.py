"""The parts that the ablation leaves out are there."""

from benchmarks.accuracy.ablation import WITHOUT


def test_what_replaces_a_part_replaces_something():
    missing = [part for part, way in WITHOUT.items() if way.module is not None and not hasattr(way.module, way.name)]
    assert missing == []
