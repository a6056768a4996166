"""The commands on a recording whose messages do not state everything."""

import json
from pathlib import Path

import pytest

from calib_core.recordings import RecordingOptions
from cocalib.opening.choice import Choice
from cocalib.opening.opened import with_remembered
from cocalib.session.events import ColumnsMapped
from tests.unit.app.session.drive import kept
from tests.vendor_recording import STATED, vendor_sample


@pytest.fixture(scope="module")
def paths(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return vendor_sample(project_root / "sample_data" / "rooftop", tmp_path_factory.mktemp("vendor"))


@pytest.mark.slow
def test_info_shows_what_was_taken_for_what_and_what_is_assumed(cocalib, paths):
    answer = cocalib("info", *paths)
    assert answer.code == 0
    assert "azimuth    f_Azimuth" in answer.out
    assert "f_Azimuth is taken" in answer.out
    summary = json.loads(cocalib("info", "--json", *paths).out)
    assert [row["quantity"] for row in summary["radar"]["columns"]] == [
        "range",
        "azimuth",
        "elevation",
        "doppler",
        "amplitude",
    ]
    assert [row["confirmed"] for row in summary["assumptions"]] == [False, False]


@pytest.mark.slow
def test_solve_waits_until_everything_is_confirmed_or_stated(cocalib, paths, sample, tmp_path):
    clicks = ("--clicks", sample / "clicks.json")
    answer = cocalib("solve", *paths, *clicks, "--out", tmp_path / "a.json")
    assert answer.code == 2
    assert "f_Azimuth is taken" in answer.err
    assert "--confirm-assumptions" in answer.err
    confirmed = cocalib("solve", *paths, *clicks, "--out", tmp_path / "b.json", "--confirm-assumptions")
    assert confirmed.code == 0, confirmed.err
    provenance = json.loads((tmp_path / "b.json").read_text())["provenance"]
    assert [one["confirmed"] for one in provenance["assumptions"]] == [True, True]
    maps = [word for one in STATED for word in ("--map", one)]
    stated = cocalib("solve", *paths, *clicks, "--out", tmp_path / "c.json", *maps)
    assert stated.code == 0, stated.err
    provenance = json.loads((tmp_path / "c.json").read_text())["provenance"]
    assert "assumptions" not in provenance
    assert tuple(provenance["column_map"]) == STATED
    first, second = (json.loads((tmp_path / name).read_text())["camera_from_radar"] for name in ("b.json", "c.json"))
    assert first == second


def test_open_uses_the_map_that_the_session_remembers_unless_another_is_given(tmp_path, capsys):
    radar = (tmp_path / "radar.bag",)
    kept(tmp_path, ColumnsMapped(tuple(STATED)))
    assert with_remembered(Choice(radar, session=tmp_path)).map == STATED
    assert "--map azimuth=f_Azimuth:rad" in capsys.readouterr().out
    assert with_remembered(Choice(radar, session=tmp_path, fresh=True)).map == ()
    given = RecordingOptions(map=("x=posX:m",))
    assert with_remembered(Choice(radar, topics=given, session=tmp_path)) is given
