"""`cocalib watch` from a baseline to the next recording, on the sample: exit codes, JSON lines, and what is refused."""

import json

import pytest

from cocalib.cli import run


@pytest.mark.slow
def test_a_baseline_is_written_once_and_the_same_recording_is_no_turn(solved_sample, bags, tmp_path, capsys):
    baseline = tmp_path / "baseline.json"
    watch = ["watch", str(solved_sample), *map(str, bags), "--baseline", str(baseline)]

    assert run(watch) == 3
    written = baseline.read_bytes()
    assert json.loads(written)["schema"] == "cocalib/baseline-1"
    assert 20_000 < len(written) < 250_000
    capsys.readouterr()

    code = run([*watch, "--json"])
    *lines, last = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert (code, last["exit_code"]) in ((0, 0), (3, 3))
    assert last["finding"] in ("nothing", "too_little")
    assert last["image"]["turned"] == last["returns"]["turned"] == []
    assert len(lines) == 7
    assert baseline.read_bytes() == written

    assert run([*watch, "--update", str(tmp_path / "new.json")]) == 1
    assert not (tmp_path / "new.json").exists()

    other = tmp_path / "other.json"
    other.write_bytes(solved_sample.read_bytes() + b"\n")
    assert run(["watch", str(other), *watch[2:]]) == 2
