"""`cocalib import`: convert a calibration from any format; if a file does not say what its numbers mean, list what they may."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.exit_codes import NO_ANSWER, exit_code
from cocalib.cli.flags import File, OutFile, Output, OutputFlags, Require, Switch, called
from cocalib.cli.tree_flags import FrameFlags, Frames, input_file
from cocalib.platform.files import write_whole

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange.check.pair_residuals import CheckPairs
    from calib_core.interchange.format import ImportedCalibration
    from calib_core.interchange.hypotheses.found_poses import FoundPose
    from calib_core.interchange.hypotheses.ranking import Hypothesis
    from calib_core.interchange.hypotheses.reading import UnstatedFile
    from calib_core.interchange.trees.reading import TreeFile


_CONTRADICTED = 0.05


@dataclass(frozen=True, slots=True)
class MeaningFlags:
    """Which pose of a file, and what it means, if the file does not say."""

    pose: Annotated[str | None, called("NAME")] = None
    """Which pose, if the file contains several: its sensor, or its place in the file, such as calibration.radar.T."""
    as_: Annotated[str | None, tyro.conf.arg(name="as", metavar="MEANING", help_behavior_hint="")] = None
    """What the numbers mean, if the file does not say: a meaning from the list that this command prints."""

    def unstated(self, files: "Sequence[TreeFile] | None", source: str) -> "UnstatedFile | None":
        """Return the poses in a file that does not say what they mean; None if it does, or if this is a tree of frames.

        Args:
            files: of the calibration; None if it is a recording.
            source: the name of it all, for error messages.

        Raises:
            InputError: flags were given that a file which states its meaning does not need.
        """
        from calib_core.interchange.hypotheses.reading import read_unstated

        alone = files[0] if files is not None and len(files) == 1 else None
        file = None if alone is None else read_unstated(alone.data, alone.source)
        if file is None:
            self._refuse_needless(source)
        return file

    def composed(self, files: "Sequence[TreeFile] | None", frames: FrameFlags) -> "ImportedCalibration | None":
        """Return what several poses make that name their frames; None if they do not, or one of them is asked for.

        Raises:
            InputError: a file cannot be read, or several radars or cameras are to choose from.
        """
        from calib_core.interchange.hypotheses.composing import read_composed

        asked = self.pose is not None or self.as_ is not None
        return None if files is None or asked else read_composed(files, frames.wanted)

    def chosen(
        self,
        file: "UnstatedFile",
        *,
        pairs: "CheckPairs | None" = None,
        against: "ImportedCalibration | None" = None,
    ) -> "ImportedCalibration | None":
        """Return the meaning that is clear or picked; None if the numbers may mean several things, which have then been listed.

        Args:
            file: what was read.
            pairs: radar positions and the pixels where they were seen.
            against: a calibration of the same sensors that is known to be right.

        Raises:
            InputError: it contains no such pose or meaning; or the pairs contradict what was picked.
        """
        from calib_core.interchange.hypotheses.ranking import clear_one, hypotheses_of
        from calib_core.interchange.hypotheses.reading import as_imported, picked

        pose = file.pose_at(self.pose)
        other = None if against is None else against.camera_from_radar
        hypotheses = hypotheses_of(pose, pairs=pairs, against=other)
        if self.as_ is not None:
            chosen = picked(hypotheses, self.as_, file.source)
            if pairs is not None or against is not None:
                _refuse_contradicted(chosen, hypotheses[0], file.source)
            return as_imported(file, pose, chosen, by_hand=True)
        clear = clear_one(pose, hypotheses)
        if clear is None:
            _list(hypotheses, Path(file.source), pose)
            return None
        _tell_of_others(hypotheses, tested=pairs is not None or against is not None)
        return as_imported(file, pose, clear, by_hand=False)

    def _refuse_needless(self, source: str) -> None:
        """Refuse flags that a file which states its meaning does not need.

        Raises:
            InputError: one was given.
        """
        for flag, value in (("--as", self.as_), ("--pose", self.pose)):
            if value is not None:
                raise InputError(f"{source}: its format states what the numbers mean; omit {flag}")


def _list(hypotheses: "Sequence[Hypothesis]", path: Path, pose: "FoundPose") -> None:
    """Print the hypotheses, how to choose one, and that nothing was written; first whether its names say lidar."""
    from calib_core.interchange.format import looks_like_lidar, of_lidar
    from calib_core.interchange.hypotheses.ranking import contradicts_names, likely_ones

    shown = likely_ones(hypotheses)
    if looks_like_lidar(pose.hints.other):
        print(of_lidar(pose.hints.other))
    print(f"{path.name}: {pose.place} does not state what its numbers mean; they may be:")
    for number, one in enumerate(shown, 1):
        print(f"{number:>3}  {one.key}  ({one.score})\n     {one.words}")
    others = len(hypotheses) - len(shown)
    print(f"{others} other meanings are less plausible." if others else "There are no others.")
    if pose.hints.other:
        missing = "camera" if pose.hints.names_radar else "radar"
        print(f"Its names mention {pose.hints.other!r} and no {missing}: is it the pose between radar and camera?")
    if contradicts_names(pose, shown[0]):
        print(
            f"Its names say {pose.hints.named_direction}, its numbers look like the other direction: find out which is right."
        )
    print(
        f"Nothing was written: pick one, such as --as {shown[0].key}; or let them be tested with --pairs FILE or --against FILE. "
        "cocalib open RECORDING --calibration FILE draws each over its frames."
    )


def _tell_of_others(hypotheses: "Sequence[Hypothesis]", *, tested: bool) -> None:
    """Print what was taken, and which other meanings are possible if nothing was tested."""
    print(f"note: taken as {hypotheses[0].key} ({hypotheses[0].score}): {hypotheses[0].words}", file=sys.stderr)
    others = [] if tested else [hypothesis for hypothesis in hypotheses[1:4] if hypothesis.fits]
    if others:
        named = "; ".join(f"{one.key} ({one.score})" for one in others)
        print(f"note: less plausible, but possible: {named}; pick with --as MEANING", file=sys.stderr)


def _refuse_contradicted(chosen: "Hypothesis", best: "Hypothesis", source: str) -> None:
    """Refuse a meaning that the tests contradict while they support another.

    Raises:
        InputError: they do.
    """
    if best.fits and chosen is not best and (not chosen.fits or chosen.share < _CONTRADICTED):
        raise InputError(
            f"{source}: --as {chosen.key} is contradicted ({chosen.score}); the test supports {best.key} ({best.score})"
        )


@dataclass(frozen=True, slots=True)
class Import:
    """Convert a calibration from any known format to cocalib/calibration-1 JSON."""

    calibration: Annotated[tuple[Path, ...], tyro.conf.Positional, called("FILE...")] = ()
    """A calibration in any format, or any file with a pose, from any program; or files, a folder or a recording with a tree."""
    out: OutFile = None
    """Output file (calibration-1 JSON)."""
    camera: File = None
    """Intrinsics to use if the file has none: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON; or the camera's frame by name."""
    image_size: Annotated[tuple[int, int] | None, called("WIDTH HEIGHT")] = None
    """Size of the images [px], if the file has a camera matrix but no size; by default that of the images beside it."""
    pairs: File = None
    """Pairs that prove what the file means: a pairs-1 file, or a calibration-1 file with pairs."""
    against: File = None
    """A calibration of the same sensors that proves what the file means."""
    replace_camera: Switch = False
    """Take --camera although the file states another camera."""
    require: Require = None
    """Exit code 3 for a verdict below this."""
    frames: Frames = field(default_factory=FrameFlags)
    meaning: Annotated[MeaningFlags, tyro.conf.arg(name="")] = field(default_factory=MeaningFlags)
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Write the calibration; return the exit code, as of no answer if its numbers may mean several things."""
        from calib_core.interchange.calibration_file import Provenance
        from calib_core.interchange.cameras.files import read_camera_file
        from calib_core.interchange.check.pair_residuals import read_check_pairs_file
        from calib_core.interchange.importing import adoption, read_any_file
        from calib_core.interchange.own.calibration_json import write_calibration as write

        if not self.calibration:
            raise InputError(
                "import takes a calibration, or the files of one: cocalib import FILE... --out calibration.json"
            )
        path, source = self.calibration[0], ", ".join(map(str, self.calibration))
        frames, lens = self._frames_and_lens()
        given = read_camera_file(lens, image_size_px=self.image_size) if lens else None
        against = read_any_file(self.against) if self.against else None
        pairs = read_check_pairs_file(self.pairs) if self.pairs else None
        files = frames.files(self.calibration)
        composed = self.meaning.composed(files, frames)
        unstated = self.meaning.unstated(files, source) if composed is None else None
        if composed is not None and files is not None:
            found, sources = composed, tuple(map(input_file, files))
        elif unstated is None or files is None:
            found, sources = frames.read(self.calibration, files)
        else:
            chosen = self.meaning.chosen(unstated, pairs=pairs, against=against)
            if chosen is None:
                return NO_ANSWER
            found, sources = chosen, (input_file(files[0]),)
        if self.out is None:
            raise InputError(f"{source}: give the output file with --out FILE")
        camera = given or _sized_camera(found, path, self.image_size)
        adopted = adoption(
            found,
            source,
            camera=camera,
            provenance=Provenance(inputs=sources),
            against=against,
            pairs=pairs,
            replace_camera=self.replace_camera,
        )
        names = ", ".join(one.name for one in self.calibration)
        file, report = adopted.file, adopted.report
        write_whole(self.out, write(file))
        print("\n".join(line for line in report.lines()[1:] if not line.startswith("ok: ")), file=sys.stderr)
        print(f"{names} read as {found.format}, {_RESTS_ON[file.rests_on]}; written to {self.out}")
        level = file.verdict.level if file.verdict else None
        return exit_code(level, file.rests_on, self.require, file.calibration.warnings)

    def _frames_and_lens(self) -> tuple[FrameFlags, Path | None]:
        """Return the frames that are named, and the file of --camera, which names a frame if it is no file."""
        if (
            self.camera is None
            or self.camera.exists()
            or self.camera.suffix
            or self.camera.name != str(self.camera)
            or self.frames.camera_frame
        ):
            return self.frames, self.camera
        return replace(self.frames, camera_frame=str(self.camera)), None


_RESTS_ON = {
    "clicked": "solved from clicks",
    "imported_proven": "its meaning proven",
    "imported_assumed": "its meaning assumed, not proven",
}


def _sized_camera(
    imported: "ImportedCalibration", path: Path, image_size_px: tuple[int, int] | None
) -> "Camera | None":
    """Return the camera of a file that states its matrix but no size, if the size is given or images are beside it.

    Raises:
        InputError: the matrix is not a camera's.
    """
    from calib_core.recordings import size_of_images_beside
    from cocalib.opening.opened import camera_of

    if imported.matrix_px is None:
        if image_size_px is not None:
            raise InputError(f"{path}: --image-size is for files with a camera matrix and no size; remove it")
        return None
    size_px = image_size_px or size_of_images_beside(path)
    if size_px is None:
        return None
    if image_size_px is None:
        print(f"note: image size {size_px[0]} x {size_px[1]} px from the images beside the file", file=sys.stderr)
    return camera_of(imported, path, size_px)
