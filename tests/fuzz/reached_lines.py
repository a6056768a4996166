"""Which lines of our own code an input reaches, by the interpreter's own tracing."""

import sys
from opcode import opmap
from pathlib import Path
from types import CodeType, FrameType, TracebackType
from typing import Any, Self

ROOT = Path(__file__).resolve().parents[2]
OURS = tuple(f"{ROOT / name}/" for name in ("calib_core", "app"))


class ReachedLines:
    """Collects the lines of calib_core and cocalib that run inside the `with` block and were not reached before.

    Attributes:
        seen: every line reached so far, as (file, line).
    """

    def __init__(self, prefixes: tuple[str, ...] = OURS) -> None:
        self.seen: set[tuple[str, int]] = set()
        self._prefixes = prefixes
        self._traced: dict[int, tuple[CodeType, set[int], Any]] = {}
        self._new = 0

    def __enter__(self) -> Self:
        self._new = 0
        if sys.version_info >= (3, 12):
            self._monitor()
        else:
            sys.settrace(self._entered)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if sys.version_info >= (3, 12):
            sys.monitoring.set_events(sys.monitoring.COVERAGE_ID, 0)
            sys.monitoring.free_tool_id(sys.monitoring.COVERAGE_ID)
        else:
            sys.settrace(None)

    @property
    def new(self) -> int:
        """How many lines the last block reached for the first time."""
        return self._new

    def _reached(self, file: str, line: int) -> None:
        if (file, line) not in self.seen:
            self.seen.add((file, line))
            self._new += 1

    if sys.version_info >= (3, 12):

        def _monitor(self) -> None:
            tool = sys.monitoring.COVERAGE_ID
            sys.monitoring.use_tool_id(tool, "fuzz")
            sys.monitoring.register_callback(tool, sys.monitoring.events.LINE, self._line)
            sys.monitoring.set_events(tool, sys.monitoring.events.LINE)

        def _line(self, code: CodeType, line: int) -> object:
            if code.co_filename.startswith(self._prefixes):
                self._reached(code.co_filename, line)
            return sys.monitoring.DISABLE  # a line counts once; the next new one is still reported

    def _entered(self, frame: FrameType, event: str, argument: Any) -> Any:
        code = frame.f_code
        known = self._traced.get(id(code))  # a code object's own hash would take as long as what is saved here
        if known is None:
            left = _lines_of(code) if code.co_filename.startswith(self._prefixes) else set()
            known = self._traced[id(code)] = (code, left, self._tracer(code.co_filename, left))
        return known[2] if known[1] else None

    def _tracer(self, file: str, left: set[int]) -> Any:
        """Return what is called for every line of a function while some of its lines have not been reached."""

        def trace(frame: FrameType, event: str, argument: Any) -> Any:
            if frame.f_lineno in left and event == "line":
                left.discard(frame.f_lineno)
                self._reached(file, frame.f_lineno)
            return trace

        return trace


def _lines_of(code: CodeType) -> set[int]:
    """Return the lines of a function that are traced: not those of its beginning, up to RESUME."""
    body = 2 + 2 * code.co_code[::2].index(opmap["RESUME"])
    return {line for _, end, line in code.co_lines() if line is not None and end > body}
