"""Open what was chosen: the recording, its intrinsics, its session, and the calibration to show until clicks give a new one."""

import dataclasses
import functools
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import sleep
from typing import TypeAlias

import calib_core.recordings as recordings
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.interchange.cameras.camera_format import refuse_another_size
from calib_core.interchange.format import ImportedCalibration
from calib_core.interchange.hypotheses.found_poses import FoundPose
from calib_core.interchange.hypotheses.ranking import Hypothesis, clear_one, hypotheses_of, likely_ones
from calib_core.interchange.hypotheses.reading import UnstatedFile, as_imported, picked, read_unstated
from calib_core.interchange.importing import adopted_calibration, calibration_bytes, read_any
from calib_core.interchange.own.clicks_json import read_clicks_file
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.recordings import Recording, RecordingOptions
from calib_core.results import DataWarning
from calib_core.words.outcomes import in_sentences
from calib_core.words.warnings import warning_remark
from cocalib.hypothesis_sheet import Offer, OpenMeaning
from cocalib.opening.choice import Choice, ChoicePart, GivenClicks, MeaningPick, UnusablePartError, part_of_choice
from cocalib.session.click_stamps import ClicksAtFrames, clicks_at_frames
from cocalib.session.events import AssumptionsConfirmed, ClicksImported, ColumnsMapped, IntrinsicsChosen, OptionsChanged
from cocalib.session.file.contents import inspect_session
from cocalib.session.file.finding import (
    FoundFolder,
    find_session_folder,
    has_session_of,
    recording_session_folder,
    remembered_map,
    unused_session_folder,
)
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.session_file import set_aside
from cocalib.session.state import RecordingFacts
from cocalib.solving.solving import camera_for
from cocalib.view.reference import Reference
from cocalib.web.messages.opening_messages import SessionOffer
from cocalib.workspace import Workspace, open_workspace, recording_facts

_Ranked: TypeAlias = Callable[[str], tuple[Hypothesis, ...]]
"""Ranks the meanings of the numbers at a place of a file, once."""
_LOOK_EVERY_S = 0.2
_NOTHING_PICKED = MeaningPick()
_MOST_POSES, _MOST_OFFERS = 4, 12


@dataclass(frozen=True, slots=True)
class Opened:
    """A recording with its session.

    Attributes:
        recording: open until the exit stack closes it.
        workspace: its session and solver.
    """

    recording: Recording
    workspace: Workspace


def open_choice(choice: Choice, stack: ExitStack, tell: Callable[[str], None]) -> Opened:
    """Open a recording and its session; the exit stack closes both.

    Without intrinsics the session is opened all the same: it can be clicked in, and is solved once they are given.

    Args:
        choice: what to open.
        stack: takes what is to be closed.
        tell: takes what is being waited for, in words.

    Raises:
        CalibrationError: the recording, the intrinsics, the clicks or the session cannot be used.
    """
    topics = with_remembered(choice)
    if choice.below is not None:
        _require_unmoved(choice)
    opened = (
        _wait_for_recording(choice, topics, tell)
        if choice.follow
        else recordings.open_recording(choice.paths, topics, require=("radar",))
    )
    recording = stack.enter_context(opened)
    if choice.below is not None:
        _require_unmoved(choice)
    if not len(recording.image_times):
        _require_nothing_to_calibrate(recording, choice)
    _tell(recording)
    with part_of_choice("clicks"):
        clicks = _clicks_at_frames(recording, choice.clicks)
    workspace = _workspace(choice, recording)
    stack.push(partial(_close, workspace))
    _remember(workspace, recording)
    for warning in workspace.restored.warnings:
        print(in_sentences(warning))
    _prefer_given_intrinsics(workspace, choice)
    if choice.options is not None and choice.options != CalibrationOptions():
        workspace.dispatch(OptionsChanged.of(choice.options))
    if choice.clicks is not None and clicks is not None:
        _import_clicks(workspace, choice.clicks.source, clicks)
    return Opened(recording, workspace)


def _tell(recording: Recording) -> None:
    """Print what is used of a recording.toml, and which radar."""
    if recording.recording_file:
        print(recording.recording_file)
    if recording.radar_choice:
        print(f"radar: {recording.radar_choice}")


def with_remembered(choice: Choice) -> RecordingOptions:
    """Return how to read a recording, with the --map that its session was last opened with, unless the user gives another."""
    topics = choice.topics
    if topics.map or choice.fresh:
        return topics
    found = remembered_map(choice.session or recording_session_folder(choice.paths))
    if found:
        print(f"Reading the radar as before in this session: {' '.join(f'--map {one}' for one in found)}")
    return dataclasses.replace(topics, map=found)


def _wait_for_recording(choice: Choice, topics: RecordingOptions, tell: Callable[[str], None]) -> Recording:
    """Wait until there is enough of a recording that is being written, telling the terminal and the pages what is missing.

    Raises:
        RecordingError: the recording cannot be followed.
    """
    told, awaited = "", recordings.AwaitedRecording(choice.paths, topics)
    try:
        while (recording := awaited.look()) is None:
            if awaited.missing != told:
                told = awaited.missing
                tell(f"Waiting for {choice.title}: {told}…")
            sleep(_LOOK_EVERY_S)
    except BaseException:
        awaited.close()
        raise
    return recording


def _require_unmoved(choice: Choice) -> None:
    """Refuse files that were chosen below the root folder and have since been replaced by links to elsewhere.

    Raises:
        InputError: a path is not real any more.
    """
    for path in choice.paths:
        if Path(path).resolve() != path:
            raise InputError(f"{path.name}: was replaced while it was being opened; choose it again")


def _workspace(choice: Choice, recording: Recording) -> Workspace:
    with part_of_choice("calibration"):
        calibration = None if choice.calibration_file is None else GivenCalibration.read(choice.calibration_file)
    camera = _camera(choice, recording, calibration)
    with part_of_choice("calibration"):
        shown = calibration.shown(camera, choice.pick) if calibration and camera else None
    facts = recording_facts(recording, choice.title)
    from_calibration = camera is not None and choice.camera_file is None and recording.camera() is None
    with part_of_choice("session"):
        copied = fitting_clicks(choice.copy_from, facts) if choice.copy_from is not None else None
        folder = session_folder(choice, facts)
        workspace = open_workspace(
            recording,
            camera=camera,
            session_folder=folder.path,
            name=choice.title,
            reference=shown.reference if shown else None,
            warnings=(
                *folder.warnings,
                *([] if copied is None else [copied.about]),
                *(calibration_warnings(calibration.name, shown) if calibration else ()),
            ),
            camera_file=choice.camera_file,
            intrinsics=calibration.name if from_calibration and calibration else "",
        )
    workspace.open_meaning = shown.meaning if shown else None
    if copied is not None and copied.clicks and workspace.restored.steps == 0:
        workspace.dispatch(ClicksImported.of(copied.clicks))
    return workspace


def _camera(choice: Choice, recording: Recording, calibration: "GivenCalibration | None") -> Camera | None:
    """Return the intrinsics: from the file, else from the recording, else from the calibration to show; None if there are none.

    Raises:
        InputError: the file cannot be used for these frames.
    """
    if not len(recording.image_times):
        return None
    if choice.camera_file is None and calibration is not None and recording.camera() is None:
        image = recording.image_bytes(0)
        with part_of_choice("calibration"):
            camera = calibration.camera((image.width_px, image.height_px))
        if camera is not None:
            return camera
    if choice.camera_file is None:
        return camera_for(recording, None)
    with part_of_choice("camera"):
        return camera_for(recording, choice.camera_file)


def _clicks_at_frames(recording: Recording, given: GivenClicks | None) -> ClicksAtFrames | None:
    """Read the clicks of a file before anything is done to a session.

    Raises:
        InputError: they are not clicks of this recording.
    """
    if given is None:
        return None
    file, source = read_clicks_file(given.text, source=given.source), given.source
    frames = clicks_at_frames(file.clicks, recording.image_times, source=source, others=recording.other_image_times)
    if file.unconfirmed is None:
        return frames
    note = f"{source}: {len(file.unconfirmed.ids)} of these clicks are unconfirmed: confirm each"
    return dataclasses.replace(frames, notes=(*frames.notes, note))


def _import_clicks(workspace: Workspace, source: str, frames: ClicksAtFrames) -> None:
    """Start a new session with the clicks of a file; one that has steps already goes on as it is."""
    if workspace.restored.steps > 0:
        print(f"Continuing the existing session; {source} was not imported (start over with --fresh)")
        return
    for line in frames.notes:
        print(f"note: {line}", file=sys.stderr)
    workspace.dispatch(ClicksImported.of(frames.clicks))


def _close(workspace: Workspace, kind: type[BaseException] | None, *_: object) -> None:
    """Close the workspace; if an error ends the program, print whether the clicks are where they should be."""
    closed = workspace.close()
    if kind is not None and closed.fault:
        print(f"cocalib: {closed.note}", file=sys.stderr)


def _prefer_given_intrinsics(workspace: Workspace, choice: Choice) -> None:
    """Solve with a file that the user gives, also in a session that had intrinsics of its own."""
    if choice.camera_file is not None and workspace.session.intrinsics is not None:
        print(f"Using {choice.camera_file.source} instead of the session's own intrinsics; undo goes back to them")
        workspace.dispatch(IntrinsicsChosen(None))


def _remember(workspace: Workspace, recording: Recording) -> None:
    """Keep in the session how the recording is read and what was confirmed about it.

    A session found under another name may have a --map that was not known when its recording was opened: it is named and kept.
    """
    before = workspace.session.column_map
    if before and not recording.column_map:
        words = " ".join(f"--map {one}" for one in before)
        print(f"In this session the radar was read with {words}; open it again with that")
    else:
        workspace.dispatch(ColumnsMapped(recording.column_map))
    sure = tuple(assumption.assumption.words for assumption in recording.stated_assumptions if assumption.confirmed)
    if sure:
        workspace.dispatch(AssumptionsConfirmed(sure))


def _require_nothing_to_calibrate(recording: Recording, choice: Choice) -> None:
    """Say that there is no camera; refuse files that need one.

    Raises:
        UnusablePartError: a file of intrinsics, of a calibration or of clicks was given.
    """
    name, found = recording.paths[0].name, _unusable_images(recording)
    camera, clicks = choice.camera_file, choice.clicks
    given: dict[ChoicePart, str | Path | None] = {
        "camera": camera.source if camera else None,
        "calibration": choice.calibration_file,
        "clicks": clicks.source if clicks else None,
    }
    for part, file in given.items():
        if file:
            raise UnusablePartError(
                part, f"{name}: no images{found}, so {file} cannot be used; give the camera's recording as well"
            )
    print(f"{name}: no images{found}: showing the radar only. To calibrate, give the camera's recording as well.")


def _unusable_images(recording: Recording) -> str:
    """Return which image topics cannot be used and why, in brackets; "" if there are none."""
    problems = [
        f"{topic.name}: {topic.problem or 'has no messages'}" for topic in recording.topics if topic.kind == "image"
    ]
    return f" ({'; '.join(problems)})" if problems else ""


def session_folder(choice: Choice, facts: RecordingFacts) -> FoundFolder:
    """Return the folder of the session to open; with `fresh`, or for a new one, the existing one is kept under another name.

    Raises:
        SessionFileError: an existing one cannot be renamed.
    """
    if choice.fresh:
        return FoundFolder(_rename_session(choice.session or recording_session_folder(choice.paths)))
    if choice.session_plan == "continue":
        return FoundFolder(choice.session) if choice.session else find_session_folder(choice.paths, facts)
    named = choice.session or recording_session_folder(choice.paths)
    if choice.session_plan == "new" and has_session_of(named, facts):
        return FoundFolder(_rename_session(named))
    return FoundFolder(unused_session_folder(named))


def _rename_session(folder: Path) -> Path:
    """Rename an existing session, so that a new one can start in its folder."""
    if (kept := set_aside(folder)) is not None:
        print(f"The previous session is kept in {kept}")
    return folder


@dataclass(frozen=True, slots=True)
class FittingClicks:
    """Clicks of another session that belong to frames of this recording.

    Attributes:
        clicks: sorted by time.
        about: how many there are, and why others are not.
    """

    clicks: tuple[ReflectorClick, ...]
    about: DataWarning


def fitting_clicks(folder: Path, facts: RecordingFacts) -> FittingClicks:
    """Return the clicks of a session whose stamp is that of a frame, on the image.

    Raises:
        SessionFileError: the session cannot be read.
    """
    repair = inspect_session(folder)
    fitting = tuple(
        click
        for click in repair.clicks
        if facts.frame_at(click.image_time) is not None and facts.has_pixel(click.u_px, click.v_px)
    )
    left = len(repair.clicks) - len(fitting)
    message = f"{len(fitting)} of the {len(repair.clicks)} clicks in {folder} were copied"
    if left:
        message += f"; {left} belong to frames that this recording does not have"
    return FittingClicks(
        fitting, DataWarning.reported("clicks-copied", message, "the session that they come from is unchanged")
    )


def session_offer(choice: Choice, facts: RecordingFacts | None, opened_in: Path | None) -> SessionOffer:
    """Describe the session that an opening would continue, or could take clicks from.

    Args:
        choice: what is to be opened.
        facts: of the recording; None if it could not be opened.
        opened_in: the folder of the session that is open; None if none is.
    """
    folder = opened_in or choice.session or recording_session_folder(choice.paths)
    try:
        repair = inspect_session(folder)
    except (SessionFileError, OSError):
        return SessionOffer(plan=choice.session_plan)
    continues = opened_in is not None or (facts is not None and has_session_of(folder, facts))
    return SessionOffer(str(folder), len(repair.clicks), repair.recording, continues, choice.session_plan)


def camera_of(imported: ImportedCalibration, path: Path, size_px: tuple[int, int]) -> Camera | None:
    """Return the camera of a calibration for images of a size; None if it has none.

    Raises:
        InputError: its matrix is not a camera's, or is that of images of another size.
    """
    if imported.camera is None and imported.matrix_px is not None:
        refuse_another_size(imported.matrix_px, size_px, str(path))
    try:
        return imported.camera_for(size_px)
    except ValueError as error:
        raise InputError(f"{path}: {error}; give the intrinsics with --camera FILE") from None


@dataclass(frozen=True, slots=True)
class ShownCalibration:
    """A calibration to show with a recording.

    Attributes:
        reference: it; None until a person picks what it means.
        meaning: what it can mean, with the meaning that is taken; None if its file says what it means.
    """

    reference: Reference | None
    meaning: OpenMeaning | None = None


@dataclass(frozen=True, slots=True)
class GivenCalibration:
    """A calibration file, read once.

    Attributes:
        path: of the file.
        content: what it states, or numbers of which it does not say what they mean.
    """

    path: Path
    content: ImportedCalibration | UnstatedFile

    @classmethod
    def read(cls, path: Path) -> "GivenCalibration":
        """Read a file.

        Raises:
            InputError: it contains no calibration.
        """
        data = calibration_bytes(path)
        return cls(path, read_unstated(data, str(path)) or read_any(data, str(path)))

    @property
    def name(self) -> str:
        """Its name, to be shown."""
        return name_text(self.path.name)

    def camera(self, size_px: tuple[int, int]) -> Camera | None:
        """Return its camera if it has this image size, else None.

        Raises:
            InputError: its matrix is not a camera's, or is that of images of another size.
        """
        if isinstance(self.content, UnstatedFile):
            sized = None if self.content.camera is None or self.content.camera.size_px is None else self.content.camera
            camera = sized.camera(image_size_px=None, source=str(self.path)) if sized else None
        else:
            camera = camera_of(self.content, self.path, size_px)
        return camera if camera is not None and (camera.width_px, camera.height_px) == size_px else None

    def shown(self, camera: Camera, pick: MeaningPick = _NOTHING_PICKED) -> ShownCalibration:
        """Return it as shown with the recording's camera; or what it can mean, if it does not say.

        Args:
            camera: the recording's.
            pick: what a person picked.

        Raises:
            InputError: it contradicts itself, fails its own check point, or has nothing of what was picked.
        """
        source, meaning, stated = str(self.path), None, self.content
        if isinstance(stated, UnstatedFile):
            unstated = stated
            ranked = functools.cache(lambda place: hypotheses_of(unstated.pose_at(place)))
            chosen = _picked_meaning(unstated, pick, source, ranked)
            meaning = _open_meaning(unstated, self.name, camera, chosen, ranked)
            if chosen is None:
                return ShownCalibration(None, meaning)
            stated = as_imported(unstated, *chosen, by_hand=bool(pick.meaning))
        return ShownCalibration(Reference(self.name, adopted_calibration(stated, source, camera=camera)), meaning)


def calibration_warnings(name: str, shown: ShownCalibration | None) -> tuple[DataWarning, ...]:
    """Return what the user must know about the calibration to show: why it is not shown, or what is assumed about it.

    Args:
        name: of its file.
        shown: the calibration; None without intrinsics.
    """
    if shown is None:
        message = f"{name} is not shown, since there are no camera intrinsics"
        hint = "drop the camera file on the page, or give --camera FILE"
        return (DataWarning.reported("calibration-not-shown", message, hint),)
    if shown.reference is None:
        message = f"{name} is not shown, since it does not state what its numbers mean"
        return (DataWarning.reported("calibration-ambiguous", message, "pick a meaning, each drawn over a frame"),)
    meaning = shown.meaning
    if meaning is not None and meaning.shown is not None:
        words = meaning.offers[meaning.shown].hypothesis.meanings[0].words
        message = f"{name} does not state what its numbers mean; it is shown as if it {words}"
        hint = "if returns lie beside what they come from, pick another meaning; clicks on the reflector test it"
        return (DataWarning.reported("calibration-picked", message, hint),)
    notes = [
        str(warning_remark(warning).message)
        for warning in shown.reference.calibration.warnings
        if warning.code == "assumed"
    ]
    if not notes:
        return ()
    hint = "returns that lie beside what they come from show that it is wrong; clicks on the reflector test it"
    return (
        DataWarning.reported("calibration-assumed", f"{name} is shown with an assumption: {'; '.join(notes)}", hint),
    )


def _picked_meaning(
    file: UnstatedFile, pick: MeaningPick, source: str, ranked: _Ranked
) -> tuple[FoundPose, Hypothesis] | None:
    """Return the meaning that was picked, or else the only plausible one; None if there are several.

    Raises:
        InputError: the file has nothing of what was picked.
    """
    if not pick.meaning and len(file.poses) > 1 and len(_of_radars(file)) != 1:
        return None
    pose = file.pose_at(pick.place or None)
    hypotheses = ranked(pose.place)
    chosen = picked(hypotheses, pick.meaning, source) if pick.meaning else clear_one(pose, hypotheses)
    return None if chosen is None else (pose, chosen)


def _of_radars(file: UnstatedFile) -> list[FoundPose]:
    return [pose for pose in file.poses if pose.hints.names_radar]


def _open_meaning(
    file: UnstatedFile,
    name: str,
    camera: Camera,
    chosen: tuple[FoundPose, Hypothesis] | None,
    ranked: _Ranked,
) -> OpenMeaning:
    """Return what a person can pick from: the meaning that is shown is always among them."""
    poses = (_of_radars(file) or file.poses)[:_MOST_POSES]
    most = _MOST_OFFERS // len(poses)
    offers = [Offer(pose.place, one) for pose in poses for one in likely_ones(ranked(pose.place))[:most]]
    if chosen is None:
        return OpenMeaning(name, tuple(offers), camera)
    shown = Offer(chosen[0].place, chosen[1])
    if shown not in offers:
        offers.insert(0, shown)
    return OpenMeaning(name, tuple(offers), camera, shown=offers.index(shown))
