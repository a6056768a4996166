"""What committed files must and must not contain."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

# Written in two halves, so that this file does not contain what it looks for.
_INDEX_HOSTS = ("pypi" + ".org", "python" + "hosted.org", "npmjs" + ".org", "files.python" + "hosted")
_PIN = re.compile(r"^[A-Za-z0-9][A-Za-z0-9._-]*(\[[a-z,]+\])?==[^\s;]+( ; [^\\]+)? \\$")
_HASH = re.compile(r"^    --hash=sha256:[0-9a-f]{64}( \\)?$")


@pytest.fixture(scope="module")
def committed_texts(project_root: Path) -> dict[str, str]:
    """Return every text file that git tracks."""
    names = subprocess.run(
        ["git", "ls-files", "-z"], cwd=project_root, capture_output=True, check=True, text=True
    ).stdout.split("\0")
    texts = {}
    for name in filter(None, names):
        path = project_root / name
        if not path.is_file() or path.is_symlink():
            continue
        data = path.read_bytes()
        if b"\0" not in data[:4096]:
            texts[name] = data.decode("utf-8", errors="replace")
    return texts


def test_no_committed_file_names_a_package_index(committed_texts):
    found = [name for name, text in committed_texts.items() if any(host in text for host in _INDEX_HOSTS)]
    assert found == []


def test_no_committed_file_names_a_folder_of_the_developers_machine(committed_texts, project_root):
    here = re.escape(str(project_root.parent))
    pattern = re.compile(rf"(?<![\w.]){here}/\w|/home/\w+/|/Users/\w+/")
    found = [
        name
        for name, text in committed_texts.items()
        if pattern.search(text) and name != "tests/architecture/" + Path(__file__).name
    ]
    assert found == []


@pytest.mark.parametrize("name", ["runtime.txt", "dev.txt"])
def test_pins_are_exact_hashed_and_without_addresses(name, project_root):
    lines = (project_root / "requirements" / name).read_text().splitlines()
    pins = [line for line in lines if line and not line.startswith((" ", "#"))]
    assert len(pins) > 20
    unexpected = [
        line
        for line in lines
        if line and not _PIN.match(line) and not _HASH.match(line) and not re.match(r"^ *# ", line)
    ]
    assert unexpected == []
    assert not any("://" in line for line in lines)


def test_the_tests_run_on_the_runtime_pins(project_root):
    def pins(name: str) -> dict[str, str]:
        lines = (project_root / "requirements" / name).read_text().splitlines()
        return {
            line.split("==")[0] + (line.split(";")[1] if ";" in line else ""): line.split("==")[1].split()[0]
            for line in lines
            if "==" in line and not line.startswith(" ")
        }

    runtime, dev = pins("runtime.txt"), pins("dev.txt")
    # dev may need a pin on more platforms than the program
    everywhere = {name: dev.get(name, dev.get(name.split()[0])) for name in runtime}
    assert everywhere == runtime


@pytest.mark.parametrize(
    "name",
    [
        "README.md",
        "CONTRIBUTING.md",
        "ARCHITECTURE.md",
        "GLOSSARY.md",
        "CHANGELOG.md",
        "LICENSE",
        "Makefile",
        ".ci/run",
    ],
)
def test_the_projects_standard_files_exist(name, project_root):
    assert (project_root / name).stat().st_size > 100


def test_nothing_in_the_code_unpickles_or_evaluates(committed_texts):
    pattern = re.compile(
        r"\bimport pickle\b|\bpickle\.loads?\b|allow_pickle=True|(?<![\w.])eval\(|(?<![\w.])exec\(|yaml\.load\(|typ=.unsafe"
    )
    found = [
        name
        for name, text in committed_texts.items()
        if name.endswith(".py") and name.startswith(("app/", "calib_core/", "benchmarks/")) and pattern.search(text)
    ]
    assert found == []


def test_docstrings_can_be_written_as_utf_8(committed_texts):
    """Python 3.13 compiles no module with one that cannot."""
    for name, text in committed_texts.items():
        for node in ast.walk(ast.parse(text)) if name.endswith(".py") else ():
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                (ast.get_docstring(node) or "").encode()
