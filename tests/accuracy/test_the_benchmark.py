"""The benchmark itself: it resumes where it stopped, does not depend on processes, and writes its results."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy import keeping
from benchmarks.accuracy.__main__ import TABLES, sections
from benchmarks.accuracy.cases import Case, bound_of, draw
from benchmarks.accuracy.efficiency import failed, measure_ours
from benchmarks.accuracy.figures import MET, MISSED, UNDECIDED, Measured, at_most, ratio, share, within
from benchmarks.accuracy.fresh_seeds import FreshSeeds, fresh_seeds, last_fresh_seeds
from benchmarks.accuracy.keeping import Keeper, digest_of_sources
from benchmarks.accuracy.page import page, table
from benchmarks.accuracy.rows import Figures, Row
from benchmarks.accuracy.running import kept_figures, run

CASE = Case("ti", 10, 0.1)


def row(trials: int = 11) -> Row:
    return Row(f"ours-{CASE.key}", trials, partial(measure_ours, CASE))


def never(trial: int) -> Figures:
    raise AssertionError(f"trial {trial} has been measured already")


def test_an_interrupted_run_resumes_where_it_stopped(tmp_path):
    keeper = Keeper(tmp_path)
    run([row()], keeper, jobs=1, trials=3)
    path = tmp_path / f"{row().key}.jsonl"
    path.write_text(path.read_text() + '{"trial": 3, "fig')  # killed in the middle of a line
    assert len(kept_figures([row()], keeper)[row().key]) == 3
    run([row()], keeper, jobs=1, trials=5)
    again = kept_figures([row()], keeper)[row().key]
    assert again == tuple(measure_ours(CASE, trial) for trial in range(5))
    run([Row(row().key, 5, never)], keeper, jobs=1)


def test_processes_do_not_change_a_figure(tmp_path):
    run([row()], Keeper(tmp_path), jobs=2)
    assert kept_figures([row()], Keeper(tmp_path))[row().key] == tuple(measure_ours(CASE, trial) for trial in range(11))


def test_fresh_seeds_are_other_trials_of_the_same_row_and_are_kept_next_to_the_fixed_ones(tmp_path):
    assert last_fresh_seeds(tmp_path) is None
    fresh = fresh_seeds(tmp_path)
    assert last_fresh_seeds(tmp_path) == fresh
    assert len(fresh.commit) == 40
    assert FreshSeeds("00000001" + 32 * "0").first_trial - FreshSeeds(40 * "0").first_trial > 10_000
    keeper = Keeper(tmp_path)
    run([row()], keeper, jobs=1, trials=2)
    run([row()], keeper, jobs=1, trials=3, first=fresh.first_trial)
    fixed = kept_figures([row()], keeper)[row().key]
    others = kept_figures([row()], keeper, first=fresh.first_trial)[row().key]
    assert (len(fixed), len(others)) == (2, 3)
    assert others[0] == measure_ours(CASE, fresh.first_trial) != fixed[0]


def test_figures_are_not_kept_across_a_change_of_the_estimator():
    assert digest_of_sources() == digest_of_sources()
    sources = [path for path in Path(keeping.__file__).parents[2].glob("calib_core/estimation/*.py")]
    assert sources
    assert set(sources) <= set(keeping.sources())


def test_every_row_has_a_key_of_its_own_that_is_a_file_name():
    keys = [row.key for rows in TABLES.values() for row in rows]
    assert len(set(keys)) == len(keys)
    assert all(key.replace("-", "").replace("_", "").replace(".", "").isalnum() for key in keys)


def test_the_page_names_met_and_missed_aims():
    good = {"rotation_rad": 0.01, "position_m": 0.01, "bound_rad": 0.01, "bound_m": 0.01, "inside": 1.0}
    bad = good | {"rotation_rad": 0.02}
    key = f"ours-{Case('ti', 20, 0.1, tape_m=None).key}"
    for figures, verdict in ((good, MET), (bad, MISSED)):
        measured = sections({key: [figures, figures, figures]})
        (claim, _) = measured["bound"].claims
        assert claim.verdict == verdict
        assert f"| {claim.aim} | {claim.measured} | {verdict} |" in page(measured)


SOUND: Figures = {
    **{"rotation_rad": 0.01, "position_m": 0.01, "stated_rad": 0.01, "stated_m": 0.01},
    **{"squared": 3.0, "quantile": 13.0, "level": 1.0, "as told": 1.0},
}


def test_the_page_names_the_commit_of_fresh_seeds_and_nothing_that_was_not_run():
    measured = sections({"shared-field-ti-12-10pc-free": [SOUND] * 3})
    assert list(measured) == ["shared"]
    text = page(measured, commit=40 * "a")
    assert "hash, aaaaaaaa," in text
    assert "not run" not in text
    assert table(measured["shared"].rows).splitlines()[1].startswith("ti 12 free,3,")


def test_rows_that_hold_the_truth_too_rarely_are_named_with_the_promise():
    rare = [SOUND] * 10 + [SOUND | {"squared": 20.0}] * 10
    text = page(sections({"shared-field-ti-12-10pc-free": rare}))
    assert "ti 12 free (50 %)" in text.partition("## How it was measured")[0]


def test_every_row_of_the_errors_that_all_pairs_share_has_an_aim():
    measured = sections({row.key: [SOUND] * 3 for row in TABLES["shared"]})
    assert len(measured["shared"].rows) == len(TABLES["shared"])
    assert all(row[aim] for row in measured["shared"].rows for aim in ("aim inside", "aim sigma", "aim position"))


def test_rows_whose_shares_are_pooled_have_draws_of_their_own(tmp_path):
    rows = [row for name in ("shared", "smooth") for row in TABLES[name]]
    assert len({row.draws for row in rows}) == len(rows)
    other = Row("other", 1, lambda trial: {"trial": float(trial)}, draws=2)
    run([other], Keeper(tmp_path), jobs=1)
    assert kept_figures([other], Keeper(tmp_path))["other"][0]["trial"] > 1000


def test_a_run_that_is_cut_has_measured_the_same_share_of_each_row(tmp_path):
    rows = [
        Row("short", 8, lambda trial: {"trial": float(trial)}),
        Row("long", 16, lambda trial: {"trial": float(trial)}),
    ]
    order: list[str] = []

    class Noting(Keeper):
        def add(self, key, trials):
            order.append(key)
            super().add(key, trials)

    run(rows, Noting(tmp_path), jobs=1)
    assert order == ["short", "long", "long", "short", "long", "long"]


def test_a_figure_above_its_limit_is_missed_only_when_that_is_significant():
    verdicts = [at_most(Measured(value, 0.04), 1.05) for value in (1.04, 1.07, 1.12, float("nan"), float("inf"))]
    assert verdicts == [MET, UNDECIDED, MISSED, UNDECIDED, MISSED]
    assert within(Measured(99.0, 1.0), 93.0, 97.0) == MISSED


def test_two_standard_errors_are_what_repetition_shows():
    rng = np.random.default_rng(1)
    measured = [
        ratio(np.linalg.norm(rng.standard_normal((200, 3)), axis=1), np.full(200, np.sqrt(3.0))) for _ in range(300)
    ]
    values = np.array([one.value for one in measured])
    assert values.mean() == pytest.approx(1.0, abs=0.01)
    assert np.mean([one.error for one in measured]) == pytest.approx(2.0 * values.std(), rel=0.15)
    assert share(np.ones(100)).error > 1.0  # all of 100 is not certainty


def test_a_trial_without_a_pose_is_a_failure():
    good: Figures = {"rotation_rad": 0.01, "position_m": 0.01, "bound_rad": 0.01, "bound_m": 0.01}
    trials = [good, good | {"rotation_rad": None, "position_m": None}, good | {"position_m": 0.07}]
    assert failed(trials).tolist() == [False, True, True]


def test_the_bound_shrinks_with_the_root_of_the_number_and_by_a_measured_position():
    free, tape = Case("imaging", 40, tape_m=None), Case("imaging", 40)
    simulated = draw(free, 0)
    once = bound_of(simulated, "imaging", None)
    points = np.concatenate([simulated.points_radar_m] * 4)
    four_times = bound_of(simulated, "imaging", None, points_radar_m=points)
    assert four_times.rotation_rad == pytest.approx(once.rotation_rad / 2.0)
    assert four_times.position_m == pytest.approx(once.position_m / 2.0)
    measured = bound_of(simulated, "imaging", tape.tape_m)
    assert measured.position_m < min(once.position_m, 0.01 * np.sqrt(3.0))
