"""An installed package that is not there: a module and its *.dist-info in a folder on sys.path."""

from pathlib import Path
from textwrap import dedent


def install(folder: Path, name: str, module: str, group: str, value: str) -> Path:
    """Write a distribution of one module, whose one entry point names a value in it.

    Args:
        folder: on sys.path.
        name: of the distribution and, with underscores, of its module.
        module: the source of the module.
        group: of the entry point.
        value: the name in the module.
    """
    importable = name.replace("-", "_")
    (folder / f"{importable}.py").write_text(dedent(module), encoding="utf-8")
    info = folder / f"{importable}-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(f"[{group}]\nany = {importable}:{value}\n", encoding="utf-8")
    return info
