"""The table of commands agrees with the commands and with the command line."""

import dataclasses
import inspect
import re
import runpy
import subprocess
import sys

import pytest

from calib_core.recordings import RecordingOptions
from cocalib.cli import tyro_hook
from cocalib.cli.commands import COMMANDS
from cocalib.option_changes import option_groups


@pytest.mark.parametrize("command", COMMANDS.values(), ids=lambda command: command.name)
def test_the_summary_of_a_command_is_the_beginning_of_its_docstring(command):
    first_paragraph = (inspect.getdoc(command.load()) or "").split("\n\n")[0]
    assert command.summary == " ".join(first_paragraph.split())


def test_the_overview_names_every_command_with_its_summary_within_a_terminal(cocalib):
    answer = cocalib("--help")
    assert answer.code == 0
    assert answer.err == ""
    words = " ".join(answer.out.split())
    for command in COMMANDS.values():
        assert f" {command.name} {command.summary}" in words
    assert max(map(len, answer.out.splitlines())) <= 80
    assert cocalib("-h") == cocalib() == answer


def test_the_version_is_one_line(cocalib):
    answer = cocalib("--version")
    assert answer.code == 0
    assert re.fullmatch(r"cocalib \d+\.\d+\.\d+\S*\n", answer.out)


@pytest.mark.parametrize("command", COMMANDS.values(), ids=lambda command: command.name)
def test_the_options_of_a_command_are_those_its_whole_help_shows(cocalib, command):
    shown = cocalib(command.name, "--help", "all")
    assert shown.code == 0
    assert shown.out.startswith(f"usage: cocalib {command.name} ")
    flags = shown.out.partition("options by name")[0]
    assert {*tyro_hook.flags_of(command.load()), "--help"} == set(re.findall(r"(?<!\S)--[a-z][a-z.-]*", flags))


@pytest.mark.parametrize("command", COMMANDS.values(), ids=lambda command: command.name)
def test_the_help_of_a_command_is_one_screen_with_flags_it_has(cocalib, command, project_root):
    shown = cocalib(command.name, "--help")
    assert (shown.code, shown.err) == (0, "")
    made = runpy.run_path(str(project_root / "docs" / "make_help.py"))["written_help"](command)
    assert shown.out == made, "write it again: python docs/make_help.py"
    lines = shown.out.splitlines()
    assert len(lines) <= 40
    assert max(map(len, lines)) <= 80
    flags = re.findall(r"^  (--[a-z-]+)", shown.out, re.MULTILINE)
    assert len(flags) <= 20
    assert {*flags} <= {*tyro_hook.flags_of(command.load()), "--help"}
    assert "None" not in shown.out
    assert "STR" not in shown.out, "every value has a name"


@pytest.mark.parametrize("command", ["open", "solve"])
def test_the_help_has_the_text_of_every_option(cocalib, command):
    words = " ".join(re.sub("[│╭╮╰╯─]", " ", cocalib(command, "--help", "all").out).split())
    texts = [description.hint for group in option_groups() for description in group.options]
    texts += [field.metadata["help"] for field in dataclasses.fields(RecordingOptions)]
    assert len(texts) > 25
    assert [text for text in texts if text not in words] == []


def test_tyro_still_has_the_private_events_that_our_usage_errors_need():
    assert tyro_hook.missing_parts() == (), (
        "this version of tyro has changed its private events; adapt app/cocalib/cli/tyro_hook.py, or lower the upper bound of "
        "tyro in pyproject.toml. Until then tyro prints its own messages for wrong usage."
    )


def test_a_tyro_without_those_events_still_runs_commands_and_prints_its_own_errors(cocalib, monkeypatch):
    monkeypatch.setitem(sys.modules, "tyro._errors_of_tomorrow", None)
    monkeypatch.setattr(tyro_hook, "_PRIVATE", "tyro._errors_of_tomorrow")
    assert tyro_hook.missing_parts() == ("tyro._errors_of_tomorrow",)
    assert cocalib("export").code == 0
    answer = cocalib("export", "--bogus", "tf2")
    assert answer.code == 2
    assert "--bogus" in answer.err


def imported_after(*arguments: str) -> set[str]:
    """Run the command in a fresh interpreter and return what it imported."""
    code = (
        "import sys\nfrom cocalib.cli import run\n"
        f"try:\n    run({list(arguments)!r})\nexcept SystemExit:\n    pass\n"
        "print('imported', *sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.rpartition("imported ")[2].split())


@pytest.mark.parametrize("arguments", [[], ["--help"], ["--version"], ["bogus"], ["solve", "--help"]], ids=str)
def test_what_needs_no_command_imports_none(arguments):
    imported = imported_after(*arguments)
    assert imported & {"numpy", "tyro", "rich", "msgspec", "calib_core.recordings", "calib_core.synthetic"} == set()
    assert imported & {command.where.partition(":")[0] for command in COMMANDS.values()} == set()


@pytest.mark.slow
@pytest.mark.parametrize("names", [[*COMMANDS], [*reversed(COMMANDS)]], ids=["forwards", "backwards"])
def test_a_command_imports_no_other_command(names):
    """In one of the two orders, whatever a command imports of another comes before the other's turn."""
    code = (
        "import sys\nfrom cocalib.cli.commands import COMMANDS\n"
        f"for name in {names!r}:\n    COMMANDS[name].load()\n    print('imported', *sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = [set(line.split()[1:]) for line in done.stdout.splitlines() if line.startswith("imported ")]
    assert len(loaded) == len(names)
    for number, modules in enumerate(loaded):
        own = {COMMANDS[name].where.partition(":")[0] for name in names[: number + 1]}
        later = {COMMANDS[name].where.partition(":")[0] for name in names[number + 1 :]} - own
        assert modules & later == set(), names[number]
