"""The entry point of the command, installed as cocalib_launcher because other projects also use the name `app`.

A folder on PYTHONPATH that contains an `app.py` comes before our packages on the path. This module therefore loads them
from where the program is installed before anything else can take their names. It must not import them with a plain `import`.
"""

import importlib.util
import sys
from pathlib import Path

__all__ = ["main"]

_PACKAGES = ("app", "calib_core")


def main() -> None:
    """Load our packages, then run the command."""
    home = _home()
    for name in _PACKAGES:
        _load(name, home / name)
    from app.__main__ import main as run

    run()


def _home() -> Path:
    """Return the folder that contains our packages: this file's folder, or the checkout of an editable install."""
    for folder in (Path(__file__).resolve().parent, *map(Path, sys.path)):
        if (folder / "app" / "cli" / "commands.py").is_file() and (folder / "calib_core" / "__init__.py").is_file():
            return folder
    sys.exit("cocalib: the packages app and calib_core are missing from the installation; reinstall cocalib")


def _load(name: str, folder: Path) -> None:
    """Import a package from its folder, even if something else on the path has the same name."""
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
