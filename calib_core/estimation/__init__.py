"""Estimation of the pose and its covariance: measurement model, initialization, GNC, errors in variables, leave-one-out."""
