"""Workers of another version are told in words before any job runs."""

from typing import Any

from cocalib.batch.engines.worker_checks import dask_trouble, version_trouble


def _part(version: str) -> dict[str, Any]:
    return {"packages": {"distributed": version}}


def test_equal_versions_are_no_trouble() -> None:
    part = _part("2026.8.0")
    assert dask_trouble({"client": part, "scheduler": part, "workers": {"tcp://127.0.0.1:1": part}}) == ""
    assert version_trouble("0.1.0", {"tcp://127.0.0.1:1": "0.1.0"}) == ""


def test_a_scheduler_of_another_dask_is_named() -> None:
    here, there = _part("2026.8.0"), _part("2026.1.0")
    found = dask_trouble({"client": here, "scheduler": there, "workers": {"tcp://127.0.0.1:1": here}})
    assert found.startswith("the scheduler runs Dask 2026.1.0 and this process 2026.8.0; install")


def test_a_worker_of_another_dask_is_named() -> None:
    here, there = _part("2026.8.0"), _part("2026.1.0")
    found = dask_trouble(
        {"client": here, "scheduler": here, "workers": {"tcp://127.0.0.1:1": here, "tcp://127.0.0.1:2": there}}
    )
    assert found.startswith("the worker at tcp://127.0.0.1:2 runs Dask 2026.1.0 and this process 2026.8.0")


def test_a_worker_without_cocalib_is_named() -> None:
    found = version_trouble(
        "0.1.0", {"tcp://127.0.0.1:1": "0.1.0", "tcp://127.0.0.1:2": ModuleNotFoundError("No module named 'app'")}
    )
    assert found == (
        "the worker at tcp://127.0.0.1:2 has no cocalib (ModuleNotFoundError: No module named 'app'); "
        "install cocalib[fleet] 0.1.0 where it runs"
    )


def test_a_worker_that_went_away_is_no_trouble() -> None:
    gone = ConnectionRefusedError("closed")
    assert version_trouble("0.1.0", {"tcp://127.0.0.1:1": "0.1.0", "tcp://127.0.0.1:2": gone}) == ""


def test_a_worker_of_another_cocalib_is_named() -> None:
    found = version_trouble("0.1.0", {"tcp://127.0.0.1:2": "9.9"})
    assert found.startswith("the worker at tcp://127.0.0.1:2 runs cocalib 9.9 and this is cocalib 0.1.0")
