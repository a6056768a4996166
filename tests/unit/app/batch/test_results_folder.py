"""Results are whole or absent: killed at any moment, written by several at once, damaged later."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, outcome_text
from cocalib.batch.results_folder import LOG_FILE, OUTCOME_FILE, ResultsFolder, Writer, listed_files

DIGEST = "0123456789abcdef0123456789abcdef"


def write(folder: ResultsFolder, *, is_final: bool = True, reason: str = "") -> None:
    """Write a result of two files and a log."""
    with folder.writing(DIGEST) as unfinished:
        (unfinished / "export").mkdir()
        (unfinished / "calibration.json").write_text("{}")
        (unfinished / "export" / "tf2.sh").write_text("#!/bin/sh\n")
        (unfinished / LOG_FILE).write_text("12:00")
        more = {"reason": reason, "is_final": is_final, "files": listed_files(unfinished)}
        outcome = Outcome(OUTCOME_SCHEMA, DIGEST, "van", "1", "solved", **more)
        (unfinished / OUTCOME_FILE).write_text(outcome_text(outcome))


def hidden(folder: ResultsFolder) -> list[str]:
    return [one.name for one in folder.folder_of("").iterdir() if one.name.startswith(".")]


def test_a_result_is_listed_without_its_outcome_and_its_log(tmp_path):
    folder = ResultsFolder(tmp_path)
    assert folder.outcome(DIGEST) is None
    write(folder)
    found = folder.outcome(DIGEST)
    assert [file.name for file in found.files] == ["calibration.json", "export/tf2.sh"]
    assert hidden(folder) == []


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("calibration.json", lambda text: "[]"),
        ("export/tf2.sh", None),
        (OUTCOME_FILE, lambda text: text[:-20]),
        (OUTCOME_FILE, lambda text: ""),
        (OUTCOME_FILE, lambda text: text.replace(DIGEST, DIGEST[::-1])),
        ("", None),
    ],
    ids=["changed", "missing", "outcome cut", "outcome empty", "of another job", "no folder"],
)
def test_a_damaged_result_is_none_and_can_be_written_again(name, damage, tmp_path):
    folder = ResultsFolder(tmp_path)
    write(folder)
    place = folder.folder_of(DIGEST) / name
    if damage:
        place.write_text(damage(place.read_text()))
    else:
        place.rename(tmp_path / "elsewhere")
    if not name:
        place.write_text("a file of that name")
    assert folder.outcome(DIGEST) is None
    write(folder)
    assert folder.outcome(DIGEST) is not None
    assert hidden(folder) == []


def test_what_may_go_well_another_time_is_run_again_and_replaced(tmp_path):
    folder = ResultsFolder(tmp_path)
    write(folder, is_final=False)
    assert folder.outcome(DIGEST) is None
    write(folder, reason="second")
    write(folder, is_final=False, reason="third")
    found = folder.outcome(DIGEST)
    assert found.reason == "second"


def test_an_error_while_writing_leaves_nothing(tmp_path):
    folder = ResultsFolder(tmp_path)
    with pytest.raises(FileNotFoundError), folder.writing(DIGEST) as unfinished:
        (unfinished / "missing" / "calibration.json").write_text("{}")
    assert list(folder.folder_of("").iterdir()) == []


_KILLED = """
    import os, signal, sys
    from pathlib import Path
    sys.path[:0] = sys.argv[2:4]
    from test_results_folder import DIGEST, write
    from cocalib.batch.results_folder import ResultsFolder

    def killing(moment):
        left = moment
        def hook(event, arguments):
            nonlocal left
            if event in ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.scandir") and ".0123" in str(arguments):
                left -= 1
                if left < 0:
                    os.kill(os.getpid(), signal.SIGKILL)
        return hook

    for moment in range(200):
        folder = ResultsFolder(Path(sys.argv[1]) / str(moment))
        write(folder)
        if moment % 2:
            (folder.folder_of(DIGEST) / "calibration.json").write_text("damaged")
        else:
            folder.folder_of(DIGEST).rename(Path(sys.argv[1]) / f"away{moment}")
        child = os.fork()
        if child == 0:
            sys.addaudithook(killing(moment // 2))
            write(folder)
            os._exit(0)
        status = os.waitpid(child, 0)[1]
        found = folder.outcome(DIGEST)
        files = {path.name for path in folder.folder_of(DIGEST).rglob("*")}
        assert found is not None or files in (set(), {"calibration.json", "export", "tf2.sh", "log.txt", "outcome.json"})
        write(folder)
        assert folder.outcome(DIGEST) is not None
        folder.remove_leftovers()
        assert [one.name for one in folder.folder_of("").iterdir()] == [DIGEST], moment
        if status == 0 and moment % 2:
            break
    print(moment, found is not None)
"""


def run_python(code: str, *arguments: str | Path) -> str:
    """Run a program that may import this file."""
    root = Path(__file__).resolve().parents[4]
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments), str(Path(__file__).parent), str(root)]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_killed_at_any_moment_a_result_is_whole_or_absent(tmp_path):
    moments, finished = run_python(_KILLED, tmp_path).split()
    assert int(moments) > 20
    assert finished == "True"


_AT_ONCE = """
    import os, sys
    from pathlib import Path
    sys.path[:0] = sys.argv[2:4]
    from test_results_folder import DIGEST, write
    from cocalib.batch.results_folder import ResultsFolder

    folder = ResultsFolder(Path(sys.argv[1]))
    children = []
    for number in range(4):
        child = os.fork()
        if child == 0:
            for turn in range(40):
                write(folder, is_final=turn > 30)
            os._exit(0)
        children.append(child)
    print([os.waitpid(child, 0)[1] for child in children])
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_several_processes_that_write_the_same_result_leave_one(tmp_path):
    assert run_python(_AT_ONCE, tmp_path).strip() == "[0, 0, 0, 0]"
    folder = ResultsFolder(tmp_path)
    assert folder.outcome(DIGEST) is not None
    assert [one.name for one in folder.folder_of("").iterdir()] == [DIGEST]


def test_what_a_living_process_writes_is_not_removed(tmp_path):
    folder = ResultsFolder(tmp_path)
    with folder.writing(DIGEST) as unfinished:
        os.utime(unfinished, (0, 0))
        assert folder.remove_leftovers() == 0
        assert unfinished.is_dir()


@pytest.mark.parametrize("age_s", [60, 7200])
def test_what_another_machine_left_is_removed_once_it_is_old(age_s, tmp_path):
    folder = ResultsFolder(tmp_path)
    elsewhere = folder.folder_of(Writer("0" * 12, 17, 4).folder_name(DIGEST))
    elsewhere.mkdir(parents=True)
    then_s = elsewhere.stat().st_mtime - age_s
    os.utime(elsewhere, (then_s, then_s))
    assert folder.remove_leftovers() == (age_s > 3600)
    assert elsewhere.is_dir() == (age_s < 3600)
