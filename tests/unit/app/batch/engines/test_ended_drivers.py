"""A driver that is killed or interrupted leaves no workers and no files behind."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "Ctrl+C"])
def test_a_driver_that_ends_leaves_no_workers(number: signal.Signals, project_root: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(project_root), "TMPDIR": str(tmp_path)}
    driver = subprocess.Popen(
        [sys.executable, "-m", "tests.batch_driver"],
        cwd=project_root, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert driver.stdout is not None
    lines = sorted(driver.stdout.readline().strip() for _ in range(3))
    assert lines == ["finished 0", "running 1", "running 2"]
    if number is signal.SIGINT:
        os.killpg(driver.pid, number)  # as a terminal does
    else:
        driver.kill()
    _, errors = driver.communicate()  # ends when no process has the pipes any more
    if number is signal.SIGINT:
        assert errors.rstrip().endswith(f"KeyboardInterrupt: {int(number)}")
        assert errors.count("Traceback") == 1
        assert list(tmp_path.iterdir()) == []
