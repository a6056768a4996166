"""Pairs become a pose with its covariance: measurement model, initialization, GNC, errors in variables, leave-one-out."""
