"""Judge a calibration on a recording: by its clicks, by boxes and radar targets, alone or against another."""
