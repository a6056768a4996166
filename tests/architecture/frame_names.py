"""A checker of frame names: in `a_from_b @ c_from_d`, b and c must be the same word.

It reads source text, runs nothing, and uses only names:

- `camera_from_radar` is a transform into `camera` from `radar`; words before and after (`nominal_camera_from_radar_start`)
  do not matter. `.inverse()` and `.T` swap the two, `.rotation` and `.perturbed(...)` keep them;
  `.translation_m` is a point of the target frame.
- `points_radar_m`, `position_radar_m`, `ray_camera` and the like are points in the named frame.
- A parameter named by role (`ego_from_sensor`, `parent_from_child`) accepts any frame for that role.
- Names without a frame are not checked.

It then compares every product, sum, assignment, return and argument. Expressions it does not understand are accepted.
"""

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

__all__ = ["FRAMES", "Finding", "Source", "check_sources"]

FRAMES = frozenset(
    {"base", "board", "body", "camera", "child", "ego", "kit", "lidar", "link", "map", "object", "optical", "parent"}
    | {"radar", "reflector", "rig", "sensor", "source", "target", "vehicle", "world"}
)
GENERIC_FRAMES = frozenset({"child", "parent", "sensor", "source", "target"})
"""Roles that any frame can have when it is passed to a function."""

_TRANSFORM = re.compile(r"(?:^|_)([a-z]+)_from_([a-z]+)(?:_|$)")
_POINTS = re.compile(
    r"(?:^|_)(?:points?|positions?|centres?|rays?|directions?|origins?)_(" + "|".join(sorted(FRAMES)) + r")(?:_|$)"
)
_SENSORS = "radar|camera|cam|lidar|world|ego|vehicle"
_FORBIDDEN = re.compile(rf"^_?(?:Rt|RT|(?:\w+_)?(?:{_SENSORS})(?:2|_to_|_2_)(?:{_SENSORS})(?:_\w+)?)$")
_PASSED = "is passed as"
_KEEPS_FRAMES = frozenset({"as_matrix", "astype", "copy", "perturbed", "reshape"})
_PASSES_THROUGH = frozenset({"array", "asarray", "ascontiguousarray", "atleast_2d", "frozen_array"})


@dataclass(frozen=True, slots=True)
class Source:
    """One file: its name, used in messages, and its text."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Finding:
    """One wrong name."""

    source: str
    line: int
    message: str

    def __str__(self) -> str:
        return f"{self.source}:{self.line}: {self.message}"


@dataclass(frozen=True, slots=True)
class _Transform:
    """A transform, or its rotation. None where only one side is known."""

    target: str | None
    source: str | None

    def __str__(self) -> str:
        return f"{self.target or '?'}_from_{self.source or '?'}"

    def agrees_with(self, other: "_Transform") -> bool:
        return all(
            mine == theirs or mine is None or theirs is None
            for mine, theirs in ((self.target, other.target), (self.source, other.source))
        )


@dataclass(frozen=True, slots=True)
class _Points:
    """Points, one point or a direction in a frame."""

    frame: str

    def __str__(self) -> str:
        return f"points in {self.frame}"


@dataclass(frozen=True, slots=True)
class _Moved:
    """A known transform applied to something unknown: points in its target frame, or a transform into it."""

    target: str

    def __str__(self) -> str:
        return f"something in {self.target}"


_Kind = _Transform | _Points | _Moved | None


def check_sources(sources: Iterable[Source]) -> list[Finding]:
    """Check several files together, so that positional arguments are compared with parameters of functions in other files."""
    trees = [(source.name, ast.parse(source.text)) for source in sources]
    parameters = _parameters_by_function(tree for _, tree in trees)
    findings: list[Finding] = []
    for name, tree in trees:
        checker = _Checker(name, parameters)
        checker.visit(tree)
        findings += checker.findings
    return findings


def _parameters_by_function(trees: Iterable[ast.Module]) -> dict[str, list[str]]:
    """Return the parameter names of each module-level function whose name is used only once."""
    found: dict[str, list[str]] = {}
    twice: set[str] = set()
    for tree in trees:
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                if node.name in found:
                    twice.add(node.name)
                found[node.name] = [argument.arg for argument in (*node.args.posonlyargs, *node.args.args)]
    return {name: names for name, names in found.items() if name not in twice}


def _named(identifier: str) -> _Kind:
    """Return the kind that a name states."""
    words = _TRANSFORM.search(identifier)
    if words and words[1] in FRAMES and words[2] in FRAMES:
        return _Transform(words[1], words[2])
    words = _POINTS.search(identifier)
    return _Points(words[1]) if words else None


def _identifier(node: ast.AST) -> str | None:
    if isinstance(node, ast.Name):
        return node.id
    return node.attr if isinstance(node, ast.Attribute) else None


def _without_roles(kind: _Kind) -> _Kind:
    """Replace role frames of a parameter, which accept any frame, by None."""
    if isinstance(kind, _Transform):
        target, source = (None if frame in GENERIC_FRAMES else frame for frame in (kind.target, kind.source))
        return _Transform(target, source)
    return None if isinstance(kind, _Points) and kind.frame in GENERIC_FRAMES else kind


def _innermost(node: ast.expr) -> ast.expr:
    """Strip `.inverse()`, `.rotation` and `.T`."""
    while True:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "inverse":
            node = node.func.value
        elif isinstance(node, ast.Attribute) and node.attr in ("rotation", "T"):
            node = node.value
        else:
            return node


def _fits(declared: _Kind, found: _Kind) -> bool:
    """Return whether the kind found agrees with the declared one."""
    if declared is None or found is None:
        return True
    if isinstance(found, _Moved):
        wanted = declared.frame if isinstance(declared, _Points) else declared.target
        return wanted is None or found.target == wanted
    if isinstance(declared, _Transform) and isinstance(found, _Transform):
        return declared.agrees_with(found)
    return declared == found


class _Checker(ast.NodeVisitor):
    """Visits one file. `_kind` infers the kind of an expression; the visit methods compare it with names."""

    def __init__(self, source: str, parameters: Mapping[str, list[str]]) -> None:
        self.findings: list[Finding] = []
        self._source = source
        self._parameters = parameters

    def _report(self, node: ast.AST, message: str) -> None:
        finding = Finding(self._source, getattr(node, "lineno", 0), message)
        if finding not in self.findings:
            self.findings.append(finding)

    # The kind of an expression

    def _kind(self, node: ast.AST | None) -> _Kind:
        if isinstance(node, ast.Name):
            return _named(node.id)
        if isinstance(node, ast.Attribute):
            return self._attribute(node)
        if isinstance(node, ast.Call):
            return self._call(node)
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        if isinstance(node, ast.Subscript):
            inner = self._kind(node.value)
            return inner if isinstance(inner, _Points) else None
        if isinstance(node, ast.IfExp):
            kind = self._kind(node.body)
            return kind if kind == self._kind(node.orelse) else None
        return None

    def _attribute(self, node: ast.Attribute) -> _Kind:
        inner = self._kind(node.value)
        if isinstance(inner, _Transform):
            if node.attr == "T":
                return _Transform(inner.source, inner.target)
            if node.attr == "translation_m":
                return _Points(inner.target) if inner.target else None
            if node.attr == "rotation":
                return inner
        if isinstance(inner, _Points) and node.attr == "T":
            return None
        return _named(node.attr)

    def _call(self, node: ast.Call) -> _Kind:
        if isinstance(node.func, ast.Attribute):
            inner = self._kind(node.func.value)
            if node.func.attr == "inverse" and isinstance(inner, _Transform):
                return _Transform(inner.source, inner.target)
            if node.func.attr in _KEEPS_FRAMES:
                return inner
        name = _identifier(node.func)
        if name in _PASSES_THROUGH and node.args:
            return self._kind(node.args[0])
        if name == "RigidTransform" and len(node.args) == 2:
            return self._rigid(node)
        return _named(name) if name and name not in self._parameters else self._returned(name)

    def _returned(self, name: str | None) -> _Kind:
        kind = _named(name) if name else None
        return kind if isinstance(kind, _Transform) else None

    def _rigid(self, node: ast.Call) -> _Kind:
        rotation, translation = (self._kind(argument) for argument in node.args)
        if not isinstance(rotation, _Transform):
            return None
        if rotation.target and isinstance(translation, _Points) and translation.frame != rotation.target:
            self._report(
                node, f"RigidTransform of {rotation} takes a translation in {rotation.target}, got {translation}"
            )
        return rotation

    def _binary(self, node: ast.BinOp) -> _Kind:
        left, right = self._kind(node.left), self._kind(node.right)
        if isinstance(node.op, ast.MatMult):
            self._require_known_frames(node)
            return self._product(node, left, right)
        if isinstance(node.op, ast.Add | ast.Sub):
            frames = {
                kind.frame if isinstance(kind, _Points) else kind.target
                for kind in (left, right)
                if isinstance(kind, _Points | _Moved)
            }
            if len(frames) == 2:
                self._report(node, f"adds or subtracts {left} and {right}")
            return _Points(frames.pop()) if len(frames) == 1 else None
        return None

    def _require_known_frames(self, node: ast.BinOp) -> None:
        for side in (node.left, node.right):
            words = _TRANSFORM.search(_identifier(_innermost(side)) or "")
            if words and not {words[1], words[2]} <= FRAMES:
                unknown = ", ".join(sorted({words[1], words[2]} - FRAMES))
                self._report(side, f"unknown frame '{unknown}': add it to FRAMES, or choose another name")

    def _product(self, node: ast.BinOp, left: _Kind, right: _Kind) -> _Kind:
        if isinstance(left, _Transform):
            inner = right.target if isinstance(right, _Transform | _Moved) else getattr(right, "frame", None)
            if left.source and inner and left.source != inner:
                self._report(node, f"{left} @ {right}: '{left.source}' meets '{inner}'")
                return None
            if isinstance(right, _Transform):
                return _Transform(left.target, right.source)
            if isinstance(right, _Points) and left.target:
                return _Points(left.target)
            return _Moved(left.target) if left.target else None
        if isinstance(left, _Points) and isinstance(right, _Transform):  # rows of points times a rotation's transpose
            if right.target and left.frame != right.target:
                self._report(node, f"{left} @ {right}: '{left.frame}' meets '{right.target}'")
                return None
            return _Points(right.source) if right.source else None
        return None

    # Where an expression gets a name

    def _compare(self, node: ast.AST, declared: str | None, value: ast.AST | None, verb: str) -> None:
        if declared is None or value is None:
            return
        want, found = _named(declared), self._kind(value)
        if verb == _PASSED:
            want = _without_roles(want)
        if not _fits(want, found):
            self._report(node, f"{verb} {declared}, but it is {found}")

    def visit_Assign(self, node: ast.Assign) -> None:
        for target in node.targets:
            self._assign(target, node.value)
        self.generic_visit(node)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
            for one, its in zip(target.elts, value.elts, strict=True):
                self._assign(one, its)
        else:
            self._compare(target, _identifier(target), value, "is called")

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self._compare(node, _identifier(node.target), node.value, "is called")
        self.generic_visit(node)

    def visit_NamedExpr(self, node: ast.NamedExpr) -> None:
        self._compare(node, node.target.id, node.value, "is called")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        for keyword in node.keywords:
            self._compare(node, keyword.arg, keyword.value, _PASSED)
        if isinstance(node.func, ast.Name) and not any(isinstance(argument, ast.Starred) for argument in node.args):
            for name, argument in zip(self._parameters.get(node.func.id, []), node.args, strict=False):
                self._compare(node, name, argument, _PASSED)
        self._kind(node)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        self._kind(node)
        self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        if isinstance(_named(node.name), _Transform):
            for statement in _own_returns(node):
                self._compare(statement, node.name, statement.value, "is returned by")
        self._forbid(node, node.name)
        self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> None:
        self._forbid(node, node.arg)

    def visit_Name(self, node: ast.Name) -> None:
        self._forbid(node, node.id)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        self._forbid(node, node.attr)
        self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> None:
        self._forbid(node, node.arg or "")
        self.generic_visit(node)

    def _forbid(self, node: ast.AST, name: str) -> None:
        if _FORBIDDEN.match(name):
            self._report(node, f"'{name}' does not say its direction: name it target_from_source")


def _own_returns(function: ast.FunctionDef) -> Iterator[ast.Return]:
    """Yield the return statements of a function, without those of nested functions."""
    waiting: list[ast.AST] = list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Return):
            yield node
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
            waiting += ast.iter_child_nodes(node)
