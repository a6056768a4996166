"""The mathematics of calibrating a lens: from corners to a camera, its covariance and the shape of the board."""
