"""The page's modules: imports name files and what these export, nothing is exported in vain, and floors have no circle."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import pytest

ENTRIES = ("page/main.js", "space/pace.js")
"""What a page loads by itself: ours, and viser's in the frame of the 3D view."""
_IMPORT = re.compile(r'^import\s+(?:(?P<what>[\w*{][^"\';]*?)\s+from\s+)?"(?P<path>[^"]+)";', re.MULTILINE)
_EXPORT = re.compile(
    r"^export\s+(?:(?:async\s+)?function\*?|class|const|let)\s+(?P<name>\w+|\{[^}]*\}|\[[^\]]*\])", re.MULTILINE
)
_LISTED = re.compile(r'^export\s+\{(?P<names>[^}]*)\}(?:\s+from\s+"(?P<path>[^"]+)")?;', re.MULTILINE)
_EITHER = re.compile(r"^(?:import|export)\b", re.MULTILINE)
_COMMENT = re.compile(r"/\*.*?\*/|(?<![:\"'`\w\\/])//[^\n]*", re.DOTALL)
_IN_COMMENT = re.compile(r'import\("(?P<path>\.[^"]+)"\)')
_FROM_TEST = re.compile(r'const \{ (?P<names>[\w, ]+) \} = await import\(["\'](?:\./|/)(?P<path>[\w/]+\.js)["\']\)')


@dataclass(frozen=True, slots=True)
class Module:
    """What a module exports and imports.

    Attributes:
        exported: names.
        imported: paths from the top of the folder, each with the names that are used of it.
        unread: statements that begin with import or export and are of no known form.
        unused: names that are imported and not used.
    """

    exported: frozenset[str]
    imported: Mapping[str, frozenset[str]]
    unread: int
    unused: frozenset[str]


def _names(listed: str) -> list[tuple[str, str]]:
    """Return pairs (name there, name here) of a list such as `a, b as c`."""
    parts = [part.split(" as ") for part in re.sub(r"[{}\[\]\n]", " ", listed).split(",") if part.strip()]
    return [(part[0].strip(), part[-1].strip()) for part in parts]


def parsed(path: str, text: str) -> Module:
    """Read a module's import and export statements."""
    code = _COMMENT.sub("", text)
    imported: dict[str, frozenset[str]] = {}
    here: set[str] = set()
    found = list(_IMPORT.finditer(code))
    for statement in found:
        target = _resolved(path, statement["path"])
        what = statement["what"] or ""
        space = re.fullmatch(r"\* as (\w+)", what)
        rest = _IMPORT.sub("", code)
        if space:
            names = set(re.findall(rf"\b{space[1]}\.(\w+)", rest))
            here.add(space[1])
        else:
            names = {there for there, _ in _names(what)}
            here |= {name for _, name in _names(what)}
        imported[target] = imported.get(target, frozenset()) | names
    listed = list(_LISTED.finditer(code))
    exported = {name for one in _EXPORT.finditer(code) for _, name in _names(one["name"])}
    for one in listed:
        exported |= {name for _, name in _names(one["names"])}
        if one["path"]:
            target = _resolved(path, one["path"])
            imported[target] = imported.get(target, frozenset()) | {there for there, _ in _names(one["names"])}
    rest = _IMPORT.sub("", code)
    unused = {name for name in here if not re.search(rf"(?:\.\.\.|(?<![.\w])){name}\b", rest)}
    read = len(found) + len(listed) + len(_EXPORT.findall(code))
    return Module(frozenset(exported), imported, len(_EITHER.findall(code)) - read, frozenset(unused))


def _resolved(path: str, target: str) -> str:
    """Return a path that a module names, from the top of the folder; as it stands if it leads out of it."""
    parts: list[str] = list(PurePosixPath(path).parent.parts)
    for part in PurePosixPath(target).parts:
        if part == ".." and parts:
            parts.pop()
        else:
            parts.append(part)
    return "/".join(parts)


def faults(texts: Mapping[str, str], *, entries: Sequence[str], used_by_tests: str = "") -> list[str]:
    """Return what does not fit together.

    Args:
        texts: of the modules, by their path from the top of the folder.
        entries: modules that nobody imports.
        used_by_tests: text of tests that import modules in the browser.
    """
    modules = {path: parsed(path, text) for path, text in texts.items() if path.endswith(".js")}
    graph = {path: [target for target in module.imported if target in modules] for path, module in modules.items()}
    return [
        *(fault for path, module in modules.items() for fault in _faults_of_imports(path, module, modules)),
        *(fault for path in modules for fault in _faults_of_comments(path, texts)),
        *_faults_of_exports(modules, used_by_tests),
        *(f"{path}: no page loads it" for path in modules if path not in _reached(graph, entries)),
        *(f"circle: {' -> '.join(circle)}" for circle in circles(graph)),
        *_faults_of_floors({path: [*graph[path], *_types(path, texts, graph)] for path in graph}),
    ]


def _faults_of_imports(path: str, module: Module, modules: Mapping[str, Module]) -> Iterator[str]:
    if module.unread:
        yield f"{path}: {module.unread} import or export statements of unknown form"
    yield from (f"{path}: does not use {name}, which it imports" for name in sorted(module.unused))
    for target, names in module.imported.items():
        if target not in modules:
            yield f"{path}: imports {target}, which does not exist"
            continue
        for name in sorted(names - modules[target].exported):
            yield f"{path}: imports {name} of {target}, which does not export it"


def _faults_of_comments(path: str, texts: Mapping[str, str]) -> Iterator[str]:
    for named in _IN_COMMENT.finditer(texts[path]):
        target = _resolved(path, named["path"])
        if target not in texts and target.replace(".js", ".d.ts") not in texts:
            yield f"{path}: a comment names {target}, which does not exist"


def _faults_of_exports(modules: Mapping[str, Module], used_by_tests: str) -> Iterator[str]:
    wanted = {
        (target, name) for module in modules.values() for target, names in module.imported.items() for name in names
    }
    for used in _FROM_TEST.finditer(used_by_tests):
        names = {name for name, _ in _names(used["names"])}
        wanted |= {(used["path"], name) for name in names}
        missing = names - (modules[used["path"]].exported if used["path"] in modules else frozenset())
        yield from (f"tests import {name} of {used['path']}, which does not export it" for name in sorted(missing))
    for path, module in modules.items():
        for name in sorted(module.exported):
            if (path, name) not in wanted:
                yield f"{path}: exports {name}, which nobody imports"


def _reached(graph: Mapping[str, Sequence[str]], entries: Sequence[str]) -> set[str]:
    reached = set(entries)
    queue = [entry for entry in entries if entry in graph]
    while queue:
        new = [target for target in graph[queue.pop()] if target not in reached]
        reached.update(new)
        queue += new
    return reached


def _types(path: str, texts: Mapping[str, str], graph: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Yield the modules whose types a module's comments name."""
    named = (_resolved(path, one["path"]) for one in _IN_COMMENT.finditer(texts[path]))
    return (target for target in named if target in graph)


def _faults_of_floors(graph: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Yield what breaks the floors: base/ imports no room, nobody imports page/, and folders have no circle."""
    folders: dict[str, set[str]] = {}
    for path, targets in graph.items():
        here = _folder(path)
        others = [target for target in targets if _folder(target) != here]
        folders.setdefault(here, set()).update(map(_folder, others))
        for target in others:
            if here == "base":
                yield f"{path}: is on the ground floor and imports {target}, of a room"
            if _folder(target) == "page":
                yield f"{path}: is below the roof and imports {target}, of the roof"
    named = {folder: sorted(targets) for folder, targets in folders.items()}
    yield from (f"circle of folders: {' -> '.join(circle)}" for circle in circles(named))


def _folder(path: str) -> str:
    return path.rpartition("/")[0]


def circles(graph: Mapping[str, Sequence[str]]) -> list[list[str]]:
    """Return a circle for each import that leads back to a module on the way to it."""
    found: list[list[str]] = []
    done: set[str] = set()

    def visit(node: str, way: list[str]) -> None:
        if node in way:
            found.append([*way[way.index(node) :], node])
        elif node not in done:
            for target in graph[node]:
                visit(target, [*way, node])
            done.add(node)

    for node in graph:
        visit(node, [])
    return found


def test_the_modules_of_the_page_fit_together(project_root):
    folder = project_root / "static"
    texts = {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for path in folder.rglob("*")
        if path.suffix in (".js", ".ts")
    }
    assert len(texts) > 20
    tests = "".join(path.read_text(encoding="utf-8") for path in (project_root / "tests" / "browser").glob("*.py"))
    assert faults(texts, entries=ENTRIES, used_by_tests=tests) == []


SOUND = {
    "main.js": 'import { start } from "./a/one.js";\nimport "./a/two.js";\nstart();\n',
    "a/one.js": """/** Words: import of nothing. @param {import("../types.js").Word} word */
import {
  second,
  third as other,
} from "./two.js";
import * as all from "./three.js";
const text = "export const no = 1;"; // export const neither = 1;
export async function start(word) {
  return second(other, all.used, text, word);
}
""",
    "a/two.js": "export const second = (x) => x;\nconst third = 3;\nexport { third };\n"
    'export { used as again } from "./three.js";\n',
    "a/three.js": "export let used = 1;\n",
    "types.d.ts": "export interface Word {}\n",
}


def test_modules_that_fit_together_have_no_faults():
    used = 'await page.evaluate("const { again } = await import("/a/two.js")")'
    assert faults(SOUND, entries=("main.js",), used_by_tests=used) == []


def test_what_a_browser_test_imports_must_be_exported():
    for names, path in (("again, gone", "a/two.js"), ("gone", "b/two.js"), ("gone", "./a/two.js")):
        used = f"const {{ {names} }} = await import('{'' if path.startswith('.') else '/'}{path}')"
        fault = f"tests import gone of {path.removeprefix('./')}, which does not export it"
        assert fault in faults(SOUND, entries=("main.js",), used_by_tests=used)


@pytest.mark.parametrize(
    ("path", "old", "new", "fault"),
    [
        ("a/one.js", "second,", "second, fourth,", "a/one.js: imports fourth of a/two.js, which does not export it"),
        ("a/one.js", '"./two.js"', '"./too.js"', "a/one.js: imports a/too.js, which does not exist"),
        ("a/one.js", '"./two.js"', '"./../../two.js"', "a/one.js: imports ../two.js, which does not exist"),
        ("a/one.js", "all.used", "all.other", "a/one.js: imports other of a/three.js, which does not export it"),
        ("a/one.js", "types.js", "type.js", "a/one.js: a comment names type.js, which does not exist"),
        ("a/one.js", "text, word", "...text", ""),
        ("a/one.js", "second(other", "second(...other", ""),
        ("a/one.js", "all.used, ", "", "a/one.js: does not use all, which it imports"),
        ("a/two.js", "const third", "export const fifth = 5;\nconst third", "a/two.js: exports fifth, which nobody imports"),
        ("a/two.js", "export { third };\n", "", "a/one.js: imports third of a/two.js, which does not export it"),
        ("a/two.js", "const third", "export default 5;\nconst third", "a/two.js: 1 import or export statements of unknown form"),
        ("a/three.js", "", 'import { second } from "./two.js";\nsecond(1);\n', "circle: a/two.js -> a/three.js -> a/two.js"),
        ("main.js", "start", "none", "main.js: imports none of a/one.js, which does not export it"),
        ("a/four.js", "", "const alone = 1;\n", "a/four.js: no page loads it"),
        ("a/one.js", '"./three.js"', '"./one.js"', "circle: a/one.js -> a/one.js"),
    ],
)  # fmt: skip
def test_a_planted_fault_is_found(path, old, new, fault):
    text = SOUND.get(path, "")
    assert old in text
    used = 'const { again } = await import("/a/two.js")'
    found = faults({**SOUND, path: text.replace(old, new, 1)}, entries=("main.js",), used_by_tests=used)
    assert fault in found if fault else found == []


FLOORS = {
    "base/state.js": "export const state = 1;\n",
    "a/one.js": 'import { state } from "../base/state.js";\nexport const one = state;\n',
    "a/three.js": "export const three = 3;\n",
    "b/two.js": 'import { one } from "../a/one.js";\nexport const two = one;\n',
    "page/main.js": 'import { three } from "../a/three.js";\nimport { two } from "../b/two.js";\nthree(two);\n',
}


def test_floors_that_stand_have_no_faults():
    assert faults(FLOORS, entries=("page/main.js",)) == []


@pytest.mark.parametrize(
    ("path", "line", "fault"),
    [
        (
            "base/state.js",
            'import "../a/three.js";\n',
            "base/state.js: is on the ground floor and imports a/three.js, of a room",
        ),
        (
            "base/state.js",
            '/** @type {import("../a/three.js").Word} */\n',
            "base/state.js: is on the ground floor and imports a/three.js, of a room",
        ),
        (
            "b/two.js",
            'import "../page/main.js";\n',
            "b/two.js: is below the roof and imports page/main.js, of the roof",
        ),
        ("a/three.js", 'import "../b/two.js";\n', "circle of folders: a -> b -> a"),
    ],
    ids=["from the ground", "a type", "into the roof", "between rooms, without a circle of files"],
)
def test_an_import_against_the_floors_is_found(path, line, fault):
    found = faults({**FLOORS, path: line + FLOORS[path]}, entries=("page/main.js",))
    assert fault in found
    assert any(one.startswith("circle: ") for one in found) == (path == "b/two.js")
