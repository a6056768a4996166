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


@pytest.mark.parametrize("owners", [{}, {"app": ["cocalib"]}, {"app": ["cocalib", "cocalib"], "numpy": ["numpy"]}])
def test_an_environment_of_its_own_is_accepted(owners: dict[str, list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "packages_distributions", lambda: owners)
    check_installation()


def test_another_package_called_app_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "packages_distributions", lambda: {"app": ["webshop", "cocalib"]})
    assert installed_app_owners() == ("cocalib", "webshop")
    with pytest.raises(InstallationError, match=r"another package, webshop, .*`uv tool install cocalib"):
        check_installation()
