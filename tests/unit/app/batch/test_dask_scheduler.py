"""A scheduler and workers that the user started, in processes of their own on loopback; which are used, and what is told."""

import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from calib_core.errors import InputError
from cocalib.batch import dask_scheduler
from cocalib.batch.dask_scheduler import DaskScheduler, checked_address, dask_trouble, version_trouble
from cocalib.batch.driving import drive
from cocalib.batch.engine import InProcess
from cocalib.batch.results_folder import ResultsFolder
from cocalib.platform.resources import version
from tests.batch_calls import quick_jobs, squared
from tests.dask_processes import scheduler_process, worker_process, worker_processes

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with scheduler_process() as (_, address):
        yield address


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_scheduler, "_PATIENCE_S", 1)
    monkeypatch.setattr(dask_scheduler, "_RESTART_S", 1)


def test_workers_of_a_scheduler_that_are_killed_change_no_outcome(address, tmp_path):
    jobs, random = quick_jobs(tmp_path, 20), np.random.default_rng(2)
    with worker_process(address, count=2) as nanny:
        alive = worker_processes(nanny.pid)

        def kill(_: object) -> None:
            if alive and random.uniform() < 0.4:
                alive.pop(int(random.integers(len(alive)))).kill()

        found = drive(jobs, DaskScheduler(address), ResultsFolder(tmp_path / "dask"), kill)
    assert alive == []
    plain = drive(jobs, InProcess(), ResultsFolder(tmp_path / "none"))
    assert [replace(one, run=None) for one in found] == [replace(one, run=None) for one in plain]


@pytest.mark.usefixtures("impatient")
def test_a_scheduler_without_workers_is_told_with_the_command_that_starts_one(address, capsys):
    with pytest.raises(InputError, match=rf"--scheduler {address}: it has no workers; start some with `dask worker"):
        list(DaskScheduler(address).run_all(squared, [(1,)]))
    assert capsys.readouterr().err.startswith(f"{address} has no workers")


def test_a_worker_of_another_version_is_told_before_any_job_runs(address, tmp_path):
    other = tmp_path / "other" / "cocalib-9.9.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: cocalib\nVersion: 9.9\n")
    root = str(Path(__file__).resolve().parents[4])
    with (
        worker_process(address, environment={"PYTHONPATH": f"{tmp_path / 'other'}:{root}"}),
        pytest.raises(InputError, match=rf"the worker at tcp://\S+ runs cocalib 9\.9 and this is cocalib {version()}"),
    ):
        drive(quick_jobs(tmp_path, 2), DaskScheduler(address), ResultsFolder(tmp_path / "out"))
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("listening", [True, False], ids=["silent", "closed"])
def test_a_scheduler_that_does_not_answer_is_told_within_seconds(listening):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        if listening:
            other.listen()
        address = f"tcp://127.0.0.1:{other.getsockname()[1]}"
        with pytest.raises(
            InputError, match=rf"--scheduler {address}: no Dask scheduler answers there within 1 s; start"
        ):
            list(DaskScheduler(address).run_all(squared, [(1,)]))


@pytest.mark.usefixtures("impatient")
def test_tls_without_certificates_is_told_in_words():
    with pytest.raises(InputError, match=r"--scheduler tls://127\.0\.0\.1:9: .*certificate"):
        list(DaskScheduler("tls://127.0.0.1:9").run_all(squared, [(1,)]))


def test_a_scheduler_that_ends_in_the_middle_is_told_and_what_is_done_is_kept(tmp_path):
    jobs, results = quick_jobs(tmp_path, 20), ResultsFolder(tmp_path / "out")
    with (
        scheduler_process() as (scheduler, address),
        worker_process(address),
        pytest.raises(InputError, match=r"stopped answering"),
    ):
        drive(jobs, DaskScheduler(address), results, lambda now: scheduler.kill() if now.latest else None)
    assert results.outcome(jobs[0].digest) is not None


def test_dask_that_is_not_installed_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(
        InputError, match=r"Dask is not installed; install cocalib\[cluster\], or leave out --scheduler"
    ):
        list(DaskScheduler("tcp://127.0.0.1:9").run_all(squared, [(1,)]))


@pytest.mark.parametrize(
    ("addresses", "words"),
    [
        ("tcp://127.0.0.1:8786 tcp://localhost:1 tcp://[::1]:8786 tls://10.0.0.7:8786 tls://head.example:8786", None),
        (
            "tcp://10.0.0.7:8786 tcp://head.example:8786 tcp://127.0.0.1.example:8786 tcp://[fe80::1]:1",
            r"without TLS is refused.*run code.*tls://",
        ),
        (
            " 8786 localhost:8786 http://127.0.0.1:8786 tcp://127.0.0.1 tcp://:8786 tcp://127.0.0.1:port "
            "tcp://127.0.0.1:99999 tcp://[::1:8786 inproc://1/2 tcp://127.0.0.1:8786/x tcp://u@127.0.0.1:8786",
            r"not an address of a Dask scheduler; write tcp://127\.0\.0\.1:8786",
        ),
    ],
    ids=["good", "without TLS", "no address"],
)
def test_this_machine_and_tls_are_accepted_and_nothing_else(addresses, words):
    for address in addresses.split(" "):
        if words is None:
            assert checked_address(address) == address
        else:
            with pytest.raises(InputError, match=words):
                checked_address(address)


def test_another_dask_is_named_with_where_it_runs():
    here, there = ({"packages": {"distributed": version}} for version in ("2026.8.0", "2026.1.0"))
    same = {"client": here, "scheduler": here, "workers": {"tcp://127.0.0.1:1": here}}
    assert dask_trouble(same) == ""
    said = "runs Dask 2026.1.0 and this process 2026.8.0"
    assert dask_trouble(same | {"scheduler": there}).startswith(f"the scheduler {said}; install")
    workers = {"tcp://127.0.0.1:1": here, "tcp://127.0.0.1:2": there}
    assert dask_trouble(same | {"workers": workers}).startswith(f"the worker at tcp://127.0.0.1:2 {said}")


@pytest.mark.parametrize(
    ("answer", "trouble"),
    [
        ("0.1.0", ""),
        (ConnectionRefusedError("closed"), ""),
        ("9.9", "the worker at tcp://127.0.0.1:2 runs cocalib 9.9 and this is cocalib 0.1.0"),
        (
            ModuleNotFoundError("No module named 'app'"),
            "the worker at tcp://127.0.0.1:2 has no cocalib (ModuleNotFoundError: No module named 'app'); "
            "install cocalib[cluster] 0.1.0 where it runs",
        ),
    ],
    ids=["equal", "went away", "older", "without"],
)
def test_a_worker_of_another_cocalib_or_without_one_is_named(answer, trouble):
    found = version_trouble("0.1.0", {"tcp://127.0.0.1:1": "0.1.0", "tcp://127.0.0.1:2": answer})
    assert found.startswith(trouble)
    assert bool(found) == bool(trouble)
