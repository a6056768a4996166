"""How accurate is the estimator, against its peers and against the bound no estimator can beat? `make bench-accuracy`."""
