"""Every command and option named in errors, hints and pages exists."""

import ast
import re
import runpy
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from cocalib.cli.commands import COMMANDS
from cocalib.cli.tyro_hook import flags_of
from cocalib.cli.usage import read_command

PROSE = {"again", "boxes-1", "cookie", "knows", "reads", "runs", "therefore", "wrote"}
"""Words that follow the program's name in sentences that do not name a command."""

_TRANSFORM_PUBLISHER = ("frame-id", "child-frame-id", "qx", "qy", "qz", "qw")
_RERUN = ("bind", "port")
_CHROMIUM = (
    *("disable-background-networking", "disable-dev-shm-usage", "disable-extensions", "disable-gpu", "headless"),
    *("host-resolver-rules", "no-first-run", "no-pdf-header-footer", "no-sandbox", "print-to-pdf", "user-data-dir"),
)
_DASK = ("death-timeout", "nthreads")
OTHER_PROGRAMS = {f"--{name}" for name in (*_TRANSFORM_PUBLISHER, *_RERUN, *_CHROMIUM, *_DASK)}
"""Options of other programs that ours names or starts."""

_COMMAND = re.compile(r"(?<![\w/.-])(?<!import )cocalib[ \t]+(?P<command>[a-z][\w-]*)(?P<rest>[^\n`;()]*)")
_OTHER_LINE = re.compile(r"\b(python|pytest|make|pip|g\+\+|docker|podman|ssh)\b|^--(own|alone|only|refining)\b")
"""Lines of other programs, and of our own measurements."""
_FLAG = re.compile(r"(?<![\w-])--[a-z][a-z0-9.-]*[a-z0-9]")

FLAGS = {name: {*flags_of(command.load()), "--help"} for name, command in COMMANDS.items()}
ANY_FLAG = set().union(*FLAGS.values(), {"--version"})


def literals(path: Path) -> Iterator[str]:
    """Yield every string of a module; an f-string's placeholders become `{}`."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    parts = {part for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in parts:
            yield node.value


def code_of(page: str) -> Iterator[str]:
    """Yield a page's code: fenced blocks line by line, and spans."""
    for block in re.findall(r"^```[^\n]*\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        yield from (line.partition("#")[0] for line in block.splitlines())
    yield from re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", page, flags=re.MULTILINE | re.DOTALL))


def unknown_names(text: str, *, prose: set[str]) -> list[str]:
    """Return the commands that do not exist, and the options that their command does not have."""
    found: list[str] = []
    for match in _COMMAND.finditer(text):
        name = match["command"]
        if name in COMMANDS:
            unknown = sorted(set(_FLAG.findall(match["rest"].partition(". ")[0])) - FLAGS[name])
            found += [f"cocalib {name} {flag}" for flag in unknown]
        elif name not in prose:
            found.append(f"cocalib {name}")
    return found


@pytest.fixture(scope="module")
def texts(project_root: Path) -> dict[str, list[str]]:
    """Return the strings of every module."""
    modules = sorted(path for package in ("app", "calib_core") for path in (project_root / package).rglob("*.py"))
    return {str(path.relative_to(project_root)): [*literals(path)] for path in modules}


def test_every_command_that_the_program_names_exists(texts):
    unknown = {
        path: names
        for path, strings in texts.items()
        if (names := [each for text in strings for each in unknown_names(text, prose=PROSE)])
    }
    assert unknown == {}


def test_every_option_that_the_program_names_exists(texts):
    unknown = {
        path: names
        for path, strings in texts.items()
        if (names := {flag for text in strings for flag in _FLAG.findall(text)} - ANY_FLAG - OTHER_PROGRAMS)
    }
    assert unknown == {}


def test_the_page_names_commands_that_exist(project_root):
    for path in sorted((project_root / "static").rglob("*.js")):
        assert unknown_names(path.read_text(encoding="utf-8"), prose=PROSE) == [], path.name


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CHANGELOG.md", "docs"])
def test_the_pages_name_commands_that_exist(page, project_root):
    path = project_root / page
    for file in sorted(path.glob("*.md")) if path.is_dir() else [path]:
        text = file.read_text(encoding="utf-8").replace(".venv/bin/cocalib", "cocalib")
        ours = [code for code in code_of(text) if not _OTHER_LINE.search(code)]
        assert [each for code in ours for each in unknown_names(code, prose=set())] == [], file.name
        if page in ("README.md", "docs"):
            assert {flag for code in ours for flag in _FLAG.findall(code)} <= ANY_FLAG | OTHER_PROGRAMS, file.name


def test_what_a_user_must_know_stays_little(project_root: Path) -> None:
    assert len(COMMANDS) == 14
    assert len({flag for flags in FLAGS.values() for flag in flags} - {"--help"}) <= 110
    assert len((project_root / "README.md").read_text(encoding="utf-8").splitlines()) <= 80


def test_the_pages_stay_short(project_root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At most 35,000 words without what a program writes: whole pages, rows of a registry, and shown output."""
    monkeypatch.setattr("calib_core.interchange.formats.registry.FORMATS", ())
    monkeypatch.setattr("calib_core.recordings.radar.registry.DECODERS", ())
    makers = {
        "formats": ("make_formats_table", "with_table"),
        "radar-formats": ("make_radar_formats", "with_tables"),
        "warnings": ("make_warnings_table", "with_tables"),
    }
    words = 0
    for path in sorted((project_root / "docs").glob("*.md")):
        text = path.read_text(encoding="utf-8")
        if path.stem in makers:
            script, name = makers[path.stem]
            maker = runpy.run_path(str(path.with_name(f"{script}.py")))[name]
            monkeypatch.setitem(maker.__globals__, "_columns", list)
            text = maker(text)
        if not re.search("written by `(python|make)", text[:900], re.IGNORECASE):
            words += len(re.sub(r"^```[^\n]*\n\$ (.*?)^```", "", text, flags=re.MULTILINE | re.DOTALL).split())
    assert 20_000 < words <= 35_000
    assert len((project_root / "docs" / "accuracy.md").read_text(encoding="utf-8").split()) <= 3_000


_REMARK = re.compile(r"( \.\.\.)?(\s{3,}\S.*|\s+#.*|)$")


def command_lines(page: Path) -> Iterator[str]:
    """Yield the command lines in a page's fenced blocks, without their remarks."""
    for block in re.findall(r"^```[^\n]*\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            if line.removeprefix("$ ").startswith("cocalib "):
                yield _REMARK.sub("", line.removeprefix("$ "))


def test_the_command_lines_of_the_pages_are_right(project_root):
    pages = [project_root / "README.md", *sorted((project_root / "docs").glob("*.md"))]
    lines = [(page.name, line) for page in pages for line in command_lines(page) if "[" not in line]
    assert len(lines) > 50
    for page, line in lines:
        _, name, *arguments = shlex.split(line)
        assert name in COMMANDS, (page, line)
        read_command(COMMANDS[name], arguments)  # refuses in words what it does not know


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("or find them with cocalib mount", ["cocalib mount"]),
        ("check it: cocalib open RECORDING --calibration FILE, and click", []),
        ("cocalib open RECORDING --calibrations FILE", ["cocalib open --calibrations"]),
        ("a calibration that cocalib wrote", []),
        ("cocalib export {} --to FORMAT [--out FILE]", []),
    ],
)
def test_a_command_that_does_not_exist_is_found(text, expected):
    assert unknown_names(text, prose=PROSE) == expected
