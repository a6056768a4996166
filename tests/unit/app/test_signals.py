"""A signal ends the program, also one that comes where Python drops exceptions."""

import subprocess
import sys

_ENDS = """
import os, signal, threading
from cocalib.signals import stop_on_signals

class Deleted:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(1000):
            pass

stop_on_signals()
try:
    deleted = Deleted()
    del deleted
    threading.Event().wait(30)
except KeyboardInterrupt as interrupt:
    print("ended by", interrupt.args[0])
"""


def test_a_signal_that_comes_while_an_object_is_deleted_ends_the_program() -> None:
    done = subprocess.run([sys.executable, "-c", _ENDS], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "ended by 15"
    assert done.stderr == ""
