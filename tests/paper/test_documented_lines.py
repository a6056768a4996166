"""docs/paper.md names functions and tests; they exist."""

import re

import calib_core.geometry
import calib_core.paper.algorithm_1
import calib_core.radar
import calib_core.results.metrics
from benchmarks.paper.judgement import PAPER, verdict
from benchmarks.paper.page import read_measured
from calib_core.results import Calibration

_ROW = re.compile(r"\| `(\w+)` \| `(test_\w+)` \|$", re.MULTILINE)


def test_every_function_and_test_in_the_table_exists(project_root):
    rows = _ROW.findall((project_root / "docs" / "paper.md").read_text(encoding="utf-8"))
    tests = "".join(path.read_text(encoding="utf-8") for path in (project_root / "tests" / "paper").glob("test_*.py"))
    homes = (
        calib_core.paper.algorithm_1,
        calib_core.results.metrics,
        calib_core.geometry,
        calib_core.radar,
        Calibration,
    )
    assert len(rows) == 10 + 6
    assert [function for function, _ in rows if not any(hasattr(home, function) for home in homes)] == []
    assert [test for _, test in rows if f"def {test}(" not in tests] == []


def test_the_judgements_of_the_experiments_are_those_of_the_table(project_root):
    text = (project_root / "docs" / "paper.md").read_text(encoding="utf-8")
    sets = read_measured().sets
    for name in PAPER:
        (said,) = re.findall(rf"\| row `{re.escape(name)}`[^|]*\| ([^|]*) \|$", text, re.MULTILINE)
        assert said == verdict(name, sets)


def test_every_line_of_algorithm_1_cites_itself():
    lines = {
        1: calib_core.paper.algorithm_1.clicks_by_time,
        2: calib_core.paper.algorithm_1.static_returns_as_printed,
        3: calib_core.paper.algorithm_1.nearest_stamp,
        4: calib_core.paper.algorithm_1.window_of,
        5: calib_core.paper.algorithm_1.z_score_inliers,
        6: calib_core.paper.algorithm_1.mean_position,
        7: calib_core.paper.algorithm_1.pose_by_iterative_ransac,
        8: calib_core.paper.algorithm_1.pose_by_sqpnp_ransac,
        9: calib_core.paper.algorithm_1.pose_of_smaller_error,
        10: calib_core.paper.algorithm_1.refined_on_all_pairs,
    }
    for line, function in lines.items():
        assert f"Algorithm 1, line {line}:" in (function.__doc__ or "")
