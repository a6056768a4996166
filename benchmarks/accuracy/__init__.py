"""Accuracy of the estimator, compared with other methods and the Cramer-Rao bound: `make bench-accuracy`."""
