"""The command's first module, installed under a name of its own, cocalib_launcher: `app` is a name that others use too.

A folder on PYTHONPATH that holds an `app.py` comes before ours; so the packages are loaded from where this program is
installed before anything else can take their names. Nothing here may import them in the ordinary way.
"""

import importlib.util
import sys
from pathlib import Path

__all__ = ["main"]

_PACKAGES = ("app", "calib_core")


def main() -> None:
    """Load our packages, then run the command that was typed."""
    home = _home()
    for name in _PACKAGES:
        _load(name, home / name)
    from app.__main__ import main as run

    run()


def _home() -> Path:
    """Return the folder that holds our packages: this file's own, or that of the checkout where one is installed."""
    for folder in (Path(__file__).resolve().parent, *map(Path, sys.path)):
        if (folder / "app" / "cli" / "commands.py").is_file() and (folder / "calib_core" / "__init__.py").is_file():
            return folder
    sys.exit("cocalib: its packages, app and calib_core, are not where they were installed; install cocalib again")


def _load(name: str, folder: Path) -> None:
    """Import a package from its folder, whatever else on the path has its name."""
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
