"""A driver that is killed or stopped leaves no workers and no files behind."""

import os
import signal
import subprocess
import sys

import psutil
import pytest

pytestmark = pytest.mark.slow

_BOUND_S = 60
_STOPPED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.mark.parametrize("number", [signal.SIGKILL, *_STOPPED], ids=["killed", "Ctrl+C", "terminated", "hung up"])
def test_a_driver_that_ends_leaves_no_workers(number, project_root, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(project_root), "TMPDIR": str(tmp_path)}
    driver = subprocess.Popen(
        [sys.executable, "-m", "tests.batch_driver"],
        cwd=project_root, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    lines = sorted(driver.stdout.readline().strip() for _ in range(3))
    assert lines == ["finished 0", "running 1", "running 2"]
    if number in (signal.SIGINT, signal.SIGHUP):
        os.killpg(driver.pid, number)  # as a terminal does
    else:
        os.kill(driver.pid, number)
    errors = _errors_until_all_ended(driver)
    if number in _STOPPED:
        assert f"KeyboardInterrupt: {int(number)}" in errors.splitlines()
        assert list(tmp_path.iterdir()) == []
    if number in (
        signal.SIGINT,
        signal.SIGTERM,
    ):  # SIGHUP ends Python's resource tracker too, which is then missed aloud
        assert errors.rstrip().endswith(f"KeyboardInterrupt: {int(number)}")
        assert errors.count("Traceback") == 1


def _errors_until_all_ended(driver: "subprocess.Popen[str]") -> str:
    """Wait until no process has the pipes any more; what survives is named and killed."""
    try:
        return driver.communicate(timeout=_BOUND_S)[1]
    except subprocess.TimeoutExpired:
        survivors = [one for one in psutil.process_iter() if _session(one.pid) == driver.pid]
        names = "\n".join(f"{one.pid} {one.status()} {' '.join(one.cmdline())}" for one in survivors)
        for one in survivors:
            one.kill()
        driver.communicate()
        pytest.fail(f"after {_BOUND_S} s these processes of the driver are left:\n{names}")


def _session(process: int) -> int:
    try:
        return os.getsid(process)
    except ProcessLookupError:
        return -1
