"""List the constants of the mathematics: `python .ci/constants.py [--missing] [--double NAME]`.

A constant is a number in estimation, association, diagnostics or results, in a table, a default or a function alike; not 0, 1,
2 and a half, nor an index, an axis or the size of an array, nor 3 and 6 in a function (dimensions of space and pose), nor the
whole numbers of a function whose docstring names the formula that has them as coefficients. Its unit is the suffix of its name
or a word of the comment or docstring beside it, its source is what else stands there. `--double` runs the coverage guard with
one of them doubled.
"""

import argparse
import ast
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tokenize
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOMS = ("estimation", "association", "diagnostics", "results")
TRIVIAL, DIMENSIONS = {0, 1, 2, 0.5}, {3, 6}
SIZED = {"arange", "diag", "empty", "eye", "full", "ones", "range", "reshape", "round", "split", "tile", "zeros"}
FORMULA = "coefficients of a formula"
NOT_MEASURES = {"axis", "axes", "shape", "ndmin", "ddof"}
UNIT = re.compile(
    r"_(m|m2|px|px2|rad|rad2|deg|s|ns|db|dbsm|mps|hz|cm|percent|share|sigmas?|ratio|odds|count|pairs|trials|steps)\b|%|\["
    r"|\b(degrees?|meters?|pixels?|seconds?|scans?|returns?|pairs?|clicks?|shares?|probabilit(y|ies)|odds|levels?|quantiles?"
    r"|sigmas?|standard deviations?|variances?|ratios?|times|factors?|steps?|draws?|samples?|freedom|percent|number of|units?)\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Constant:
    """A number in the source, and what is said of it."""

    name: str
    path: Path
    node: ast.Constant
    said: str
    has_unit: bool


def constants(path: Path, root: Path) -> Iterator[Constant]:
    """Yield the constants of a module, numbered within the name that they belong to."""
    with path.open("rb") as stream:
        tokens = [token for token in tokenize.tokenize(stream.readline) if token.type == tokenize.COMMENT]
    comments = {token.start[0]: token.string.lstrip("# ") for token in tokens}
    alone = {token.start[0] for token in tokens if token.line.lstrip().startswith("#")}
    numbers, module = Counter[str](), path.relative_to(root / "calib_core").with_suffix("").as_posix()
    for owner, node, beside in numbers_of(ast.parse(path.read_text(encoding="utf-8")), "", ""):
        above = comments[node.lineno - 1] if node.lineno - 1 in alone else ""
        said = f"{above} {comments.get(node.lineno, '')} {beside}".strip()
        unit = bool(UNIT.search(f"{owner} {said}"))
        yield Constant(f"{module}:{owner}.{numbers[owner]}", path, node, said, unit)
        numbers[owner] += 1


def numbers_of(node: ast.AST, owner: str, beside: str) -> Iterator[tuple[str, ast.Constant, str]]:
    """Yield each number that counts with the name of its table, field or function, and the docstring beside an assignment."""
    body = getattr(node, "body", None)
    for child in ast.iter_child_nodes(node):
        inner, said = owner, beside
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            inner = f"{owner}.{child.name}".strip(".")
            said = FORMULA if "coefficients" in (ast.get_docstring(child) or "") else ""
        elif isinstance(child, ast.Assign | ast.AnnAssign) and isinstance(node, ast.Module | ast.ClassDef):
            target = child.target if isinstance(child, ast.AnnAssign) else child.targets[0]
            after = body[body.index(child) + 1 :][:1] if isinstance(body, list) else []
            inner = f"{owner}.{ast.unparse(target)}".strip(".")
            said = next((ast.unparse(one.value) for one in after if isinstance(one, ast.Expr)), "")
        if isinstance(child, ast.Constant):
            in_function = not isinstance(node, ast.Module | ast.ClassDef) and owner.rpartition(".")[2].islower()
            if (
                type(child.value) in (int, float)
                and abs(child.value) not in TRIVIAL | (DIMENSIONS if in_function else set())
                and not (beside == FORMULA and child.value % 1 == 0)
            ):
                yield owner, child, beside.replace(FORMULA, "")
        elif not structural(child):
            yield from numbers_of(child.value if isinstance(child, ast.Subscript) else child, inner, said)


def structural(node: ast.AST) -> bool:
    """Return whether the numbers of a node are indices, axes or sizes."""
    if isinstance(node, ast.Call):
        return getattr(node.func, "attr", getattr(node.func, "id", "")) in SIZED
    return isinstance(node, ast.keyword) and node.arg in NOT_MEASURES


def run_doubled(constant: Constant, root: Path) -> int:
    """Run the coverage guard on a copy of the mathematics with one constant doubled."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(root / "calib_core", Path(folder) / "calib_core")
        copy, node = Path(folder) / constant.path.relative_to(root), constant.node
        lines = copy.read_bytes().splitlines(keepends=True)
        line, start, end = lines[node.lineno - 1], node.col_offset, node.end_col_offset
        lines[node.lineno - 1] = b"%s(2 * %s)%s" % (line[:start], line[start:end], line[end:])
        copy.write_bytes(b"".join(lines))
        paths = os.pathsep.join([folder, str(root / "app"), str(root)])
        guard = [sys.executable, "-P", "-m", "benchmarks.accuracy.coverage_guard"]
        return subprocess.run(guard, cwd=root, env=os.environ | {"PYTHONPATH": paths}, check=False).returncode


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missing", action="store_true", help="list those without a unit or a source only")
    parser.add_argument("--double", metavar="NAME", help="a constant by its name in the list")
    arguments = parser.parse_args()
    checkout = Path(__file__).resolve().parents[1]
    modules = [path for room in ROOMS for path in sorted((checkout / "calib_core" / room).rglob("*.py"))]
    every = [constant for path in modules for constant in constants(path, checkout)]
    if arguments.double:
        sys.exit(run_doubled(next(one for one in every if one.name == arguments.double), checkout))
    for one in every:
        if not arguments.missing or not (one.has_unit and one.said):
            print(f"{one.name} = {one.node.value}: {one.said or 'NO SOURCE'}{'' if one.has_unit else ' (NO UNIT)'}")
    units, sources = sum(not one.has_unit for one in every), sum(not one.said for one in every)
    print(f"{len(every)} constants, {units} without a unit, {sources} without a source")
