"""Where the program's own files are, and whether another package overwrites it."""

import importlib.metadata
from pathlib import Path

import pytest

from app import resources
from app.resources import (
    InstallationError,
    check_installation,
    installed_app_owners,
    sample_folder,
    static_folder,
    version,
)


def test_a_checkout_has_its_files_next_to_the_package(project_root: Path) -> None:
    assert static_folder() == project_root / "static"
    assert sample_folder() == project_root / "sample_data"


def test_an_installed_package_has_its_files_inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site-packages" / "app"
    (package / "static").mkdir(parents=True)
    (tmp_path / "site-packages" / "static").mkdir()  # another package's
    monkeypatch.setattr(resources, "_PACKAGE_FOLDER", package)
    assert static_folder() == package / "static"


def test_missing_files_are_reported_with_the_folders_searched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resources, "_PACKAGE_FOLDER", tmp_path / "app")
    with pytest.raises(InstallationError, match="the folder sample_data is neither in"):
        sample_folder()


def test_the_version_is_the_installed_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "version", lambda name: {"cocalib": "1.2.3"}[name])
    assert version() == "1.2.3"


def test_an_uninstalled_checkout_has_a_version_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", missing)
    assert version() == "0+unknown"


class Installed:
    """A distribution with these metadata files."""

    def __init__(self, name: str, **files: str) -> None:
        self.name = name
        self._files = files

    def read_text(self, name: str) -> str | None:
        return self._files.get(name.partition(".")[0].lower())


OURS = Installed("cocalib", record="__editable__.cocalib.pth,sha256=a,1\n")


@pytest.mark.parametrize(
    "others",
    [
        (),
        (OURS,),
        (Installed("numpy", record="numpy/app/a.py,sha256=a,1\nmyapp/a.py,,\napple/b.py,,\n"),),
        (Installed("old", top_level="apps\nthe.app\n", record="app/a.py,,\n"),),
        (Installed("bare"),),
    ],
)
def test_an_environment_of_its_own_is_accepted(others: tuple[Installed, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "distributions", lambda: (OURS, *others))
    check_installation()


@pytest.mark.parametrize(
    "webshop",
    [
        Installed("webshop", top_level="webshop\napp\n"),
        Installed("webshop", record="app/__init__.py,sha256=a,1\n"),
        Installed("webshop", record='webshop/a.py,,\n"app/with, comma.py",,\n'),
    ],
)
def test_another_package_called_app_is_refused_by_name(webshop: Installed, monkeypatch: pytest.MonkeyPatch) -> None:
    ours = Installed("cocalib", record="app/__init__.py,,\n")
    monkeypatch.setattr(importlib.metadata, "distributions", lambda: (webshop, ours))
    assert installed_app_owners() == ("cocalib", "webshop")
    with pytest.raises(InstallationError, match=r"another package, webshop, .*`uv tool install cocalib"):
        check_installation()
