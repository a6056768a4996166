"""Render the frames of all dwells ahead of time: `python -m benchmarks.proposing.rendering FOLDER FIRST COUNT`."""

import sys
import time
from pathlib import Path

import cv2
import numpy as np

from benchmarks.proposing.cases import case_of
from benchmarks.proposing.drawn import Drawn, draw
from calib_core.errors import OptionError
from calib_core.measurements import NS_PER_S

__all__ = ["main"]

_AT_ENDS_S = 0.3


def main(folder: Path, first: int, count: int) -> int:
    """Render cases one after the other; those that are kept already take a moment."""
    cv2.setNumThreads(1)
    for seed in range(first, first + count):
        begin_s, case = time.perf_counter(), case_of(seed)
        try:
            drawn = draw(case, folder)
        except OptionError as error:
            print(f"{case.name}: {error}", flush=True)
            continue
        for index in _within_dwells(drawn):
            if not (folder / case.name / f"{index}.jpg").is_file():
                drawn.frames.image(index)
        found = f"{len(drawn.placements)} of {len(drawn.recording.placements)} placements"
        print(f"{case.name}: {found}, {time.perf_counter() - begin_s:.0f} s, {', '.join(case.traits[1:])}", flush=True)
    return 0


def _within_dwells(drawn: Drawn) -> list[int]:
    times, margin_ns = drawn.frames.image_times, int(_AT_ENDS_S * NS_PER_S)
    inside = np.zeros(len(times), dtype=np.bool_)
    for placement in drawn.placements:
        inside |= (times >= placement.start + margin_ns) & (times <= placement.end - margin_ns)
    return [int(index) for index in np.flatnonzero(inside)]


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])))
