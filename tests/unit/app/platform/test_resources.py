"""Where the program's own files are."""

import importlib.metadata

import pytest

from cocalib.platform import resources
from cocalib.platform.resources import InstallationError, sample_folder, site_folder, static_folder, version


def test_a_checkout_has_its_files_at_its_top(project_root):
    assert static_folder() == project_root / "static"
    assert sample_folder() == project_root / "sample_data"


def test_an_installed_package_has_its_files_inside(tmp_path, monkeypatch):
    package = tmp_path / "site-packages" / "cocalib"
    (package / "static").mkdir(parents=True)
    (tmp_path / "site-packages" / "static").mkdir()  # another package's
    monkeypatch.setattr(resources, "_PACKAGE_FOLDER", package)
    assert static_folder() == package / "static"


def test_documentation_whose_build_was_cut_off_counts_as_none(tmp_path, monkeypatch):
    monkeypatch.setattr(resources, "_PACKAGE_FOLDER", tmp_path)
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "method.html").touch()
    assert site_folder() is None
    (tmp_path / "site" / "index.html").touch()
    assert site_folder() == tmp_path / "site"


def test_missing_files_are_reported_with_the_folders_searched(tmp_path, monkeypatch):
    monkeypatch.setattr(resources, "_PACKAGE_FOLDER", tmp_path / "site-packages" / "cocalib")
    with pytest.raises(InstallationError, match="the folder sample_data is neither in"):
        sample_folder()


def test_the_version_is_the_installed_one_and_an_uninstalled_checkout_has_one_too(monkeypatch):
    monkeypatch.setattr(importlib.metadata, "version", lambda name: {"cocalib": "1.2.3"}[name])
    assert version() == "1.2.3"

    def missing(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", missing)
    assert version() == "0+unknown"
