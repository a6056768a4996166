"""`cocalib intrinsics`: calibrate a lens from images of a board, or convert a file with intrinsics."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import tyro

from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.options import LensChoice
from calib_core.recordings import RecordingOptions
from calib_core.words.outcomes import said_of
from cocalib.cli.flags import MORE, OutFile, Output, OutputFlags, Switch, called, same
from cocalib.cli.output import explain_unsolvable, progress_bar
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.interchange.own.lens_documents import ImageSource
    from calib_core.intrinsics.board import Board
    from calib_core.intrinsics.calibrated_lens import CalibratedLens
    from calib_core.intrinsics.coverage import BoardSearch
    from calib_core.results import DataWarning
    from cocalib.intrinsics import OpenImages


@dataclass(frozen=True, slots=True)
class BoardFlags:
    """Which calibration board is in the images."""

    board: Annotated[str | None, called("COLUMNSxROWS")] = None
    """Size of the board: inner corners of a checkerboard (9x6 for 10 x 7 squares), squares of a ChArUco board, tags of a grid."""
    square_mm: Annotated[float | None, called("MM")] = None
    """Side of a square, or of a tag of an AprilGrid [mm]."""
    kind: Literal["checkerboard", "charuco", "aprilgrid"] = "checkerboard"
    """Kind of board."""
    marker_mm: Annotated[float | None, called("MM")] = None
    """Side of a marker of a ChArUco board [mm]; three quarters of a square if not given."""
    dictionary: Annotated[str | None, called("NAME")] = None
    """Markers as OpenCV names them; DICT_5X5_250 for ChArUco and DICT_APRILTAG_36h11 for an AprilGrid if not given."""
    tag_spacing: Annotated[float | None, called("RATIO")] = None
    """Gap between the tags of an AprilGrid, as a share of a tag's side (Kalibr's tagSpacing); 0.3 if not given."""

    def required(self) -> "Board":
        """Return the board.

        Raises:
            InputError: something about it is missing, or does not apply to this kind.
        """
        from calib_core.intrinsics.board import board_of_size

        if self.board is None or self.square_mm is None:
            missing = " and ".join(
                flag
                for flag, value in (("--board 9x6", self.board), ("--square-mm 25", self.square_mm))
                if value is None
            )
            raise InputError(
                f"which board is in the images is not said: give {missing} "
                "(a checkerboard of 10 x 7 squares has 9x6 inner corners)"
            )
        return board_of_size(
            self.board,
            self.square_mm,
            self.kind,
            marker_mm=self.marker_mm,
            tag_spacing=self.tag_spacing,
            dictionary=self.dictionary,
        )


BoardUsed: TypeAlias = Annotated[BoardFlags, tyro.conf.arg(name="")]


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Calibrate a camera's lens from images of a board, or convert a file with intrinsics."""

    source: Annotated[tuple[Path, ...], tyro.conf.Positional, called("SOURCE...")] = ()
    """A recording, a video, a folder of images or image files of one camera; or a file with intrinsics."""
    image_topic: Annotated[str | None, called("TOPIC")] = same(RecordingOptions, "image_topic")
    board: BoardUsed = field(default_factory=BoardFlags)
    out: OutFile = None
    """Write the intrinsics to this file (ROS camera_info YAML unless --to or the suffix says otherwise)."""
    to: Annotated[str | None, called("FORMAT")] = None
    """Format of the intrinsics: ros, kalibr, opencv, colmap, json."""
    rescale: Annotated[str | None, called("WIDTHxHEIGHT")] = None
    """With a file with intrinsics: convert them to the same images, resized to this size [px]."""
    report: OutFile = None
    """Write a report on the lens to this file (.html)."""
    json: Switch = False
    """Print everything as JSON (cocalib/intrinsics-1)."""
    verbose: Switch = False
    """List every view and every image that was left out."""
    model: Annotated[LensChoice, MORE] = "auto"
    """Lens model; auto takes the simplest that predicts views it has not seen as well as any."""
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Calibrate or convert; return the exit code."""
        if not self.source:
            raise InputError(
                "SOURCE is missing: give a recording, a video, a folder of images or image files; "
                "see cocalib intrinsics --help"
            )
        if self._is_camera_file():
            return self._convert()
        self._require_fitting()
        return self._calibrate()

    def _is_camera_file(self) -> bool:
        from cocalib.cli.lens_output import CAMERA_SUFFIXES

        path = Path(str(self.source[0]).partition("#")[0])
        return len(self.source) == 1 and not path.is_dir() and path.suffix.lower() in CAMERA_SUFFIXES

    def _convert(self) -> int:
        from cocalib.cli.lens_output import convert_camera, require_format, size_of

        if self.report or self.json or self.board != BoardFlags() or self.image_topic:
            raise InputError(
                f"{self.source[0]} is a file with intrinsics, which is printed or converted (--to, --out), if any; for the other "
                "options, give the recording, video or images of the board"
            )
        require_format(self.to)
        size_px = size_of(self.rescale) if self.rescale is not None else None
        return convert_camera(self.source[0], to=self.to, out=self.out, size_px=size_px)

    def _require_fitting(self) -> None:
        """Refuse files that could not be written, before the search.

        Raises:
            InputError: one has another suffix than its content.
        """
        if self.report is not None and self.report.suffix.lower() not in (".html", ".htm"):
            raise InputError(f"{self.report}: the report is an .html file; name it NAME.html")
        from cocalib.cli.lens_output import require_format

        require_format(self.to)
        if self.rescale is not None:
            raise InputError(f"--rescale {self.rescale} applies to a file with intrinsics; give it as the source")
        if self.to is not None and self.out is None:
            raise InputError(f"--to {self.to}: give the file to write with --out FILE")

    def _calibrate(self) -> int:
        from calib_core.interchange.own.lens_documents import ImageSource
        from calib_core.intrinsics.board_search import search_boards
        from calib_core.intrinsics.calibrating import calibrate_lens
        from calib_core.measurements import Unsolvable
        from cocalib.cli.lens_output import left_out_lines
        from cocalib.intrinsics import open_images

        board = self.board.required()
        with open_images(self.source, RecordingOptions(image_topic=self.image_topic)) as images:
            source = ImageSource(_source_name(self.source), len(images), images.digest())
            with progress_bar("searching the board") as progress:
                found = search_boards(images, board, progress=lambda now: progress(now.searched, now.total))
            lens = found if isinstance(found, Unsolvable) else calibrate_lens(found, self.model)
            if isinstance(lens, Unsolvable) or isinstance(found, Unsolvable):
                assert isinstance(lens, Unsolvable)
                code = explain_unsolvable(lens)
                lines = () if isinstance(found, Unsolvable) else left_out_lines(found.left_out)
                print("".join(f"  {line}\n" for line in lines), end="", file=sys.stderr)
                return code
            lens = replace(lens, warnings=(*lens.warnings, *_series_warnings(images)))
            return self._deliver(lens, found, source)

    def _deliver(self, lens: "CalibratedLens", found: "BoardSearch", source: "ImageSource") -> int:
        """Write and print the lens; return the exit code."""
        from calib_core.interchange.own.intrinsics_json import write_intrinsics
        from calib_core.intrinsics.coverage import view_coverage
        from cocalib.cli.lens_output import DOUBTFUL, lens_lines, write_camera
        from cocalib.intrinsics.field_of_view import field_of_view_deg

        coverage = view_coverage([view.corners for view in lens.views], lens.board, found.size_px)
        told = sys.stderr if self.json else sys.stdout
        if self.json:
            text = write_intrinsics(
                lens,
                source,
                searched=found.searched,
                field_of_view_deg=field_of_view_deg(lens.camera),
                coverage=coverage,
            )
            print_exactly(text)
            for warning in lens.warnings:
                print(f"warning: {said_of(warning)}", file=sys.stderr)
        else:
            print("\n".join(lens_lines(lens, found, coverage, verbose=self.verbose)))
        if self.out is not None:
            write_camera(lens.camera, self.to, self.out, told=told)
            print(f"use it: cocalib open RECORDING --camera {self.out}", file=told)
        elif not self.json:
            print("use it: write it with --out camera.yaml, then cocalib open RECORDING --camera camera.yaml")
        if self.report is not None:
            from cocalib.report.lens_page import lens_report_html

            write_whole(self.report, lens_report_html(lens, source, coverage, searched=found.searched))
            print(f"report written to {self.report}", file=told)
        return 3 if any(warning.code in DOUBTFUL for warning in lens.warnings) else 0


def _source_name(paths: tuple[Path, ...]) -> str:
    """Return what messages call the source."""
    names = [name_text(path.name or str(path)) for path in paths]
    return " + ".join(names) if len(names) < 3 else f"{names[0]} to {names[-1]}"


def _series_warnings(images: "OpenImages") -> "Iterator[DataWarning]":
    """Warn if the files given are perhaps of several cameras."""
    from calib_core.results import DataWarning
    from cocalib.intrinsics.image_sources import FileImages, series_of

    series = series_of(images.paths) if isinstance(images, FileImages) else {}
    if len(series) > 1:
        yield DataWarning("several-series", {"series": {name: len(found) for name, found in series.items()}})
