"""Speed, as ratios within one run: `make bench`."""

import os

# before NumPy is loaded, as the application does: on matrices this small, threads of linear algebra only get in the way
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
