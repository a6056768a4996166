"""The process keeps freed memory."""

import platform
import subprocess
import sys

import pytest

_FAULTS = """
import resource, sys
import numpy as np
from cocalib.memory import keep_freed_memory
if "keep" in sys.argv:
    keep_freed_memory()
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
def test_the_c_library_takes_every_setting() -> None:
    code = "import sys; from cocalib.memory import keep_freed_memory; sys.exit(not keep_freed_memory())"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the C library is not glibc")
def test_pictures_reuse_the_memory_of_earlier_ones() -> None:
    answer = subprocess.run([sys.executable, "-c", _FAULTS, "keep"], check=True, capture_output=True, text=True)
    assert int(answer.stdout) < 1000  # 20 pictures of two sizes are over 60 000 pages
