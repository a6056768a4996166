"""Plain arrays: text, NumPy's npz, MATLAB's mat."""
