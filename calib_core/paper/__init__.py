"""Algorithm 1 of the paper as printed, and its perspective-n-point solvers."""
