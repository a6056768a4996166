"""A signal ends the program, also one that comes where Python drops exceptions."""

import os
import platform
import signal
import subprocess
import sys
import threading

import pytest

from cocalib.platform.process import go_last

_ENDS = """
import os, signal, threading
from cocalib.platform.process import stop_on_signals

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


def test_a_signal_that_comes_while_an_object_is_deleted_ends_the_program():
    done = subprocess.run([sys.executable, "-c", _ENDS], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "ended by 15"
    assert done.stderr == ""


_HELD_UP = """
import itertools, signal, threading
from cocalib.platform import process
process._GRACE_S = 0.2
process.stop_on_signals()
def busy():
    while True:
        pass
def serve():
    print("serving", flush=True)
    threading.Event().wait(50)
try:
    {before}
except KeyboardInterrupt:
    {after}
"""
_HELD_UP_BY = {
    "a thread": ("threading.Thread(target=busy).start(); serve()", "pass"),
    "a loop": ("serve()", "busy()"),
    "a C call": ("serve()", "sum(itertools.repeat(0))"),
    "an earlier Ctrl+C": ("serve()", "signal.raise_signal(signal.SIGTERM) or busy()"),
}


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="the system has no timer that ends a process")
@pytest.mark.parametrize("held_up_by", _HELD_UP_BY)
def test_ten_sigterms_end_the_program_whatever_holds_it_up(held_up_by):
    before, after = _HELD_UP_BY[held_up_by]
    number = signal.SIGINT if held_up_by == "an earlier Ctrl+C" else signal.SIGTERM
    start = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    program = start + _HELD_UP.format(before=before, after=after)
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            assert running.stdout.readline() == "serving\n"
            for _ in range(10):
                running.send_signal(number)
            assert running.wait(timeout=60) == -signal.SIGALRM
        finally:
            running.kill()


_FAULTS = """
import resource
import numpy as np
from cocalib.platform.process import keep_freed_memory
assert keep_freed_memory(), "the C library takes every setting"
def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        np.ones(6_000_000, dtype=np.uint8)
        np.ones(7_000_000, dtype=np.uint8)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
faults()
print(faults())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the C library is not glibc")
def test_images_reuse_the_memory_of_earlier_ones():
    answer = subprocess.run([sys.executable, "-c", _FAULTS], check=True, capture_output=True, text=True)
    assert int(answer.stdout) < 1000  # 20 images of two sizes are over 60 000 pages


@pytest.mark.skipif(sys.platform != "linux", reason="a thread has a priority of its own on Linux only")
def test_a_thread_in_the_background_gives_way_and_the_others_do_not():
    main = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    found: list[int] = []

    def run() -> None:
        for _ in range(2):
            go_last()
            found.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id()))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert found == [max(main, 10)] * 2
    assert os.getpriority(os.PRIO_PROCESS, threading.get_native_id()) == main
