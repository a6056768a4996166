"""A batch that is driven keeps its index, and ends with the summary page."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from cocalib.batch.driving import BatchProgress
from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.plan import write_plan
from cocalib.fleet.batch_index import indexed_batch
from cocalib.fleet.index import index_path, read_fleet
from tests.unit.app.fleet.made_results import make_result


def test_each_result_is_in_the_index_at_once_and_the_page_comes_at_the_end(tmp_path: Path) -> None:
    rows = [ManifestRow("V0", "s0", ()), ManifestRow("V1", "s0", ())]
    write_plan(tmp_path, Path("fleet.toml"), [Job(row, "unknown") for row in rows])
    with indexed_batch(tmp_path) as progress:
        progress(BatchProgress(0, 2))
        for done, row in enumerate(rows, start=1):
            progress(BatchProgress(done, 2, make_result(tmp_path, row.vehicle, row.session)))
            with closing(sqlite3.connect(index_path(tmp_path))) as reader:
                assert reader.execute("SELECT max(place) + 1 FROM sessions").fetchone() == (done,)
        assert not (tmp_path / "summary.html").exists()
    assert "V1" in (tmp_path / "summary.html").read_text()
    assert len(read_fleet(tmp_path).vehicles) == 2


def test_a_batch_that_is_interrupted_leaves_the_index_of_what_is_done(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        _interrupted(tmp_path)
    with closing(sqlite3.connect(index_path(tmp_path))) as reader:
        assert reader.execute("SELECT vehicle FROM sessions").fetchall() == [("V0",)]


def _interrupted(folder: Path) -> None:
    with indexed_batch(folder) as progress:
        progress(BatchProgress(1, 2, make_result(folder, "V0", "s0")))
        raise KeyboardInterrupt


def test_a_batch_without_any_result_leaves_no_page(tmp_path: Path) -> None:
    with indexed_batch(tmp_path):
        pass
    assert not (tmp_path / "summary.html").exists()
