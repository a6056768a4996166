"""`cocalib export --to mcap`: the new recording, what is refused, and that nothing half-written stays."""

import errno
import io
import json
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest
from mcap.reader import make_reader

import cocalib.cli.export as command
from cocalib.cli import run


@pytest.fixture(scope="module")
def exported(solved_sample: Path, bags: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the new recording."""
    out = tmp_path_factory.mktemp("exported") / "new.mcap"
    assert run(["export", str(solved_sample), "--to", "mcap", "--recording", *map(str, bags), "--out", str(out)]) == 0
    return out


@pytest.mark.slow
def test_the_new_recording_gives_the_same_calibration_from_the_same_clicks(
    cocalib, sample, solved_sample, exported, tmp_path
):
    again = tmp_path / "again.json"
    assert cocalib("solve", exported, "--clicks", sample / "clicks.json", "--out", again).code == 0
    first, second = (json.loads(path.read_text()) for path in (solved_sample, again))
    for document in (first, second):
        document["provenance"].pop("inputs")
    assert first == second
    assert '"imageMode"' in exported.with_name("new.foxglove-layout.json").read_text()
    assert sorted(path.name for path in exported.parent.iterdir()) == ["new.foxglove-layout.json", "new.mcap"]
    with exported.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        times = [message.log_time for _, _, message in reader.iter_messages(log_time_order=False)]
        assert reader.get_header().profile == "ros1"
    assert all(before <= after for before, after in pairwise(times))


@pytest.mark.slow
def test_a_foreign_layout_is_not_written_over(cocalib, bags, solved_sample, tmp_path):
    (tmp_path / "new.foxglove-layout.json").write_text("mine")
    typed = ("export", solved_sample, "--to", "mcap", "--recording", *bags, "--out", tmp_path / "new.mcap")
    assert cocalib(*typed).code == 2
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]
    for more in (("--force",), ()):
        done = cocalib(*typed, *more)
        assert done.code == 0
        assert "unchanged; added: " in done.out


class Full(io.RawIOBase):
    """A disk with room for some bytes."""

    def __init__(self, stream, room, error):
        self.stream, self.room, self.error = stream, room, error

    def write(self, data):
        self.room -= len(data)
        if self.room < 0:
            raise self.error
        return self.stream.write(data)


@pytest.mark.parametrize(
    "stop", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()], ids=["full", "ctrl-c"]
)
def test_nothing_half_written_stays(stop, cocalib, bags, solved_sample, tmp_path, monkeypatch):
    writing = command.writing_whole

    @contextmanager
    def small(path):
        with writing(path) as stream:
            yield Full(stream, 1_000_000, stop)

    monkeypatch.setattr(command, "writing_whole", small)
    done = cocalib("export", solved_sample, "--to", "mcap", "--recording", *bags, "--out", tmp_path / "new.mcap")
    assert done.code != 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("to", ["mcap", "tf2", "into"])
def test_an_assumed_meaning_is_said_with_every_export(to, cocalib, bags, solved_sample, tmp_path):
    content = json.loads(solved_sample.read_text()) | {"evidence": "imported_assumed", "warnings": []}
    assumed, vehicle = tmp_path / "assumed.json", tmp_path / "vehicle.urdf"
    assumed.write_text(json.dumps(content))
    cocalib("export", solved_sample, "--to", "urdf", "--out", vehicle)
    options = {
        "mcap": ("--to", "mcap", "--recording", *bags, "--out", tmp_path / "new.mcap"),
        "tf2": ("--to", "tf2"),
        "into": ("--into", vehicle),
    }[to]

    answer = cocalib("export", assumed, *options)
    assert answer.code == 0, answer.err
    assert "(imported_assumed)" in answer.err
