"""How good is a calibration on a recording? Residuals at clicks (AED, CDSD), and radar returns in boxes (Acc)."""
