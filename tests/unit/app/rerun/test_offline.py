"""Nothing of Rerun's reaches the internet, and everything else works where rerun-sdk is missing.

`strace -f -e trace=connect` of the viewer in this environment shows connections to 127.0.0.1 only; without it, it asks a
name server.
"""

import subprocess
import sys

import pytest

from calib_core.errors import InputError
from cocalib.rerun import require_display
from cocalib.rerun.viewer import offline_environment

BLOCKED = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("rerun", "rerun_cli", "rerun_bindings"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Absent())
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name.startswith("rerun") else found(name, package)
from cocalib.cli import run
sys.exit(run(sys.argv[1:]))
"""


def without_rerun(*arguments: object) -> "subprocess.CompletedProcess[str]":
    """Run a command in an interpreter that has no rerun-sdk."""
    command = [sys.executable, "-c", BLOCKED, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_viewer_is_told_to_send_nothing_even_if_the_user_forces_it():
    environment = offline_environment(
        {"FORCE_RERUN_ANALYTICS": "1", "PATH": "/bin", "HTTPS_PROXY": "http://proxy:3128"}
    )
    assert environment["CI"] == "1"
    assert "FORCE_RERUN_ANALYTICS" not in environment
    assert {environment[name] for name in ("ALL_PROXY", "HTTPS_PROXY", "HTTP_PROXY")} == {"http://127.0.0.1:9"}
    assert environment["PATH"] == "/bin"


@pytest.mark.slow
def test_commands_without_rerun_work_where_it_is_missing(project_root):
    answer = without_rerun("info", project_root / "sample_data" / "rooftop" / "radar.bag")
    assert answer.returncode == 0, answer.stderr


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), ("--out", "view.rrd")], ids=["window", "file"])
def test_commands_that_need_rerun_say_how_to_install_it(more, tmp_path):
    answer = without_rerun("show", tmp_path / "a.bag", "--calibration", tmp_path / "c.json", *more)
    assert answer.returncode == 2
    assert "needs rerun-sdk" in answer.stderr
    assert "pip install 'cocalib[rerun]'" in answer.stderr
    assert "Traceback" not in answer.stderr


def test_without_a_display_other_ways_are_named():
    with pytest.raises(InputError, match="cocalib show"):
        require_display({}, "linux")
    for environment, platform in (({"DISPLAY": ":0"}, "linux"), ({"WAYLAND_DISPLAY": "w"}, "linux"), ({}, "darwin")):
        require_display(environment, platform)
