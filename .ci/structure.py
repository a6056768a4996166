"""Count and draw the structure of the packages from their imports: `python .ci/structure.py [count|draw|grown|keep] [CHECKOUT]`.

A room is a module or package of a folder. `count` prints, for each folder, the number of its rooms, the number of floors (a
room is on a floor above all rooms that it imports) and the number of imports between rooms. `draw` prints the layers declared
in pyproject.toml. `grown` warns reviewers of folders, and of the whole, that have 10 % more rooms or files than `keep` wrote in
.ci/house.json the last time that somebody decided so. Nothing is imported: the sources are read as text.
"""

import ast
import json
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

PACKAGES = {"calib_core": "calib_core", "cocalib": "app/cocalib"}  # import name: folder
WIDTH = 118
KEPT = ".ci/house.json"


def modules(root: Path) -> dict[str, Path]:
    """Return the path of every module by its dotted name; a package is listed under its own name."""
    found = {}
    for package, folder in PACKAGES.items():
        for path in sorted((root / folder).rglob("*.py")):
            parts = (package, *path.relative_to(root / folder).with_suffix("").parts)
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(root: Path) -> dict[str, set[str]]:
    """Return the modules that each module imports, including modules re-exported by a package."""
    known = modules(root)
    graph: dict[str, set[str]] = {}
    for name, path in known.items():
        targets: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                below = {f"{node.module}.{alias.name}" for alias in node.names} & known.keys()
                targets |= below or {node.module}
            elif isinstance(node, ast.Import):
                targets |= {alias.name for alias in node.names}
        graph[name] = (targets & known.keys()) - {name}
    return graph


def between_rooms(graph: Mapping[str, set[str]], folder: str) -> dict[str, set[str]]:
    """Return the rooms that each room of a folder imports: a room is a module, or a package as a whole."""

    def room(module: str) -> str | None:
        head, _, rest = module.partition(f"{folder}.")
        return rest.partition(".")[0] if not head and rest else None

    rooms: dict[str, set[str]] = {own: set() for module in graph if (own := room(module))}
    for module, targets in graph.items():
        own = room(module)
        if own:
            rooms[own] |= {other for target in targets if (other := room(target)) and other != own}
    return rooms


def floors(rooms: Mapping[str, set[str]]) -> dict[str, int]:
    """Return the floor of each room, 0 for rooms that import no other; circular imports are an error.

    Raises:
        ValueError: rooms import each other circularly.
    """
    floor: dict[str, int] = {}
    while len(floor) < len(rooms):
        ready = {name for name, below in rooms.items() if name not in floor and below <= floor.keys()}
        if not ready:
            raise ValueError("circular imports among " + ", ".join(sorted(rooms.keys() - floor.keys())))
        floor |= {name: 1 + max((floor[other] for other in rooms[name]), default=-1) for name in ready}
    return floor


def counted(root: Path) -> Iterator[str]:
    """Yield one line per folder with rooms, then the totals."""
    graph = imports(root)
    folders = sorted({name.rpartition(".")[0] for name in graph} - {""})
    yield f"{'folder':<42}{'rooms':>6}{'floors':>8}{'imports between rooms':>23}"
    for folder in folders:
        rooms = between_rooms(graph, folder)
        yield f"{folder:<42}{len(rooms):>6}{1 + max(floors(rooms).values()):>8}{sum(map(len, rooms.values())):>23}"
    across = sum(name.rpartition(".")[0] != target.rpartition(".")[0] for name in graph for target in graph[name])
    total = sum(map(len, graph.values()))
    yield f"{len(folders)} packages, {len(graph)} modules, {total} imports between modules, {across} of them between packages"


def house(root: Path) -> dict[str, int]:
    """Return the number of rooms of each folder that has at least ten, and of all files of the product, the page included."""
    graph = imports(root)
    folders = {name.rpartition(".")[0] for name in graph} - {""}
    rooms = {folder: len(between_rooms(graph, folder)) for folder in sorted(folders)}
    page = [path for path in (root / "static").rglob("*") if path.suffix in {".js", ".css", ".html"}]
    return {"files": len(graph) + len(page)} | {folder: count for folder, count in rooms.items() if count >= 10}


def grown(root: Path) -> Iterator[str]:
    """Yield a warning for each number of `house` that is 10 % above the one kept."""
    kept = json.loads((root / KEPT).read_text(encoding="utf-8"))
    for name, count in house(root).items():
        if name in kept and count >= 1.1 * kept[name]:
            yield f"warning for the reviewer: {name}: {count}, was {kept[name]}; join, or run: python .ci/structure.py keep"


def keep(root: Path) -> Iterator[str]:
    """Write the numbers of `house` down."""
    (root / KEPT).write_text(json.dumps(house(root), indent=1) + "\n", encoding="utf-8")
    yield f"{KEPT} is written"


def drawn(root: Path) -> Iterator[str]:
    """Yield the layers of every contract in pyproject.toml, the top layer first."""
    settings = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    for contract in contracts:
        for container in contract.get("containers", ()) if contract["type"] == "layers" else ():
            yield container
            yield from _wrapped(contract["layers"])


def _wrapped(layers: list[str]) -> Iterator[str]:
    line = "   "
    for number, layer in enumerate(layers):
        piece = f" {layer}" if number == 0 else f" > {layer}"
        if len(line + piece) > WIDTH:
            yield line
            line = "     "
        line += piece
    yield line


def main(arguments: list[str]) -> None:
    """Print what is asked for."""
    what = arguments[0] if arguments else "count"
    root = Path(arguments[1]) if len(arguments) > 1 else Path(__file__).resolve().parents[1]
    for line in {"count": counted, "draw": drawn, "grown": grown, "keep": keep}[what](root):
        print(line)


if __name__ == "__main__":
    main(sys.argv[1:])
