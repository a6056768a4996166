"""Speed, as ratios within one run: `make bench`."""

import os

# Before NumPy is loaded, as in the application: on matrices this small, BLAS threads only slow things down.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
