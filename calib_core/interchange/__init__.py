"""Read and write files: clicks, pairs, cameras, calibrations, formats of other tools."""
