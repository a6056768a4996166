"""Open what was chosen: the recording, its intrinsics, the calibration to show, its session."""

import dataclasses
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import sleep

import calib_core.recordings as recordings
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.interchange.own.clicks_json import read_clicks_file
from calib_core.options import CalibrationOptions
from calib_core.recordings import Recording, RecordingOptions
from cocalib.opening.choice import Choice, ChoicePart, GivenClicks, UnusablePartError, part_of_choice
from cocalib.opening.reference import about_calibration, camera_in, meaning_of, reference_from
from cocalib.opening.sessions import fitting_clicks, session_folder
from cocalib.session import AssumptionsConfirmed, ClicksImported, ColumnsMapped, IntrinsicsChosen, OptionsChanged
from cocalib.session.click_stamps import ClicksAtFrames, clicks_at_frames
from cocalib.session.file import recording_session_folder, remembered_map
from cocalib.solving.solving import camera_for
from cocalib.view import Reference, sentence
from cocalib.workspace import Workspace, open_workspace, recording_facts

_LOOK_EVERY_S = 0.2


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
        _awaited(choice, topics, tell)
        if choice.follow
        else recordings.open_recording(choice.paths, topics, require=("radar",))
    )
    recording = stack.enter_context(opened)
    if choice.below is not None:
        _require_unmoved(choice)
    if not len(recording.image_times):
        _require_nothing_to_calibrate(recording, choice)
    if recording.radar_choice:
        print(f"radar: {recording.radar_choice}")
    with part_of_choice("clicks"):
        clicks = _clicks_at_frames(recording, choice.clicks)
    workspace = _workspace(choice, recording)
    stack.push(partial(_close, workspace))
    _remember(workspace, recording)
    for warning in workspace.restored.warnings:
        print(f"{sentence(warning.message)} {sentence(warning.hint)}")
    _prefer_given_intrinsics(workspace, choice)
    if choice.options is not None and choice.options != CalibrationOptions():
        workspace.dispatch(OptionsChanged.of(choice.options))
    if choice.clicks is not None and clicks is not None:
        _import_clicks(workspace, choice.clicks, clicks)
    return Opened(recording, workspace)


def with_remembered(choice: Choice) -> RecordingOptions:
    """Return how to read a recording, with the --map that its session was last opened with, unless the user gives another."""
    topics = choice.topics
    if topics.map or choice.fresh:
        return topics
    found = remembered_map(choice.session or recording_session_folder(choice.paths))
    if found:
        print(f"Reading the radar as before in this session: {' '.join(f'--map {one}' for one in found)}")
    return dataclasses.replace(topics, map=found)


def _awaited(choice: Choice, topics: RecordingOptions, tell: Callable[[str], None]) -> Recording:
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
    camera = _camera(choice, recording)
    calibration = choice.calibration_file
    with part_of_choice("calibration"):
        shown = reference_from(calibration, camera, choice.pick) if calibration and camera else None
        meaning = meaning_of(calibration, camera, choice.pick) if calibration and camera else None
    reference = shown if isinstance(shown, Reference) else None
    facts = recording_facts(recording, choice.title)
    from_calibration = camera is not None and choice.camera_file is None and recording.camera() is None
    with part_of_choice("session"):
        copied = fitting_clicks(choice.copy_from, facts) if choice.copy_from is not None else None
        found = session_folder(choice, facts)
        workspace = open_workspace(
            recording,
            camera=camera,
            session_folder=found.path,
            name=choice.title,
            reference=reference,
            warnings=(
                *found.warnings,
                *([] if copied is None else [copied.about]),
                *(about_calibration(calibration, shown, meaning) if len(recording.image_times) else ()),
            ),
            camera_file=choice.camera_file,
            intrinsics=name_text(calibration.name) if from_calibration and calibration else "",
        )
    workspace.open_meaning = meaning
    if copied is not None and copied.clicks and workspace.restored.steps == 0:
        workspace.dispatch(ClicksImported.of(copied.clicks))
    return workspace


def _camera(choice: Choice, recording: Recording) -> Camera | None:
    """Return the intrinsics: from the file, else from the recording, else from the calibration to show; None if there are none.

    Raises:
        InputError: the file cannot be used for these frames.
    """
    if not len(recording.image_times):
        return None
    calibration = choice.calibration_file
    if choice.camera_file is None and calibration is not None and recording.camera() is None:
        picture = recording.image_bytes(0)
        with part_of_choice("calibration"):
            found = camera_in(calibration, picture.width_px, picture.height_px)
        if found is not None:
            return found
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
    clicks = read_clicks_file(given.text, source=given.source).clicks
    return clicks_at_frames(clicks, recording.image_times, source=given.source)


def _import_clicks(workspace: Workspace, given: GivenClicks, found: ClicksAtFrames) -> None:
    """Start a new session with the clicks of a file; one that has steps already goes on as it is."""
    if workspace.restored.steps > 0:
        print(f"Continuing the existing session; {given.source} was not imported (start over with --fresh)")
        return
    for line in found.moved:
        print(f"note: {line}", file=sys.stderr)
    unconfirmed = read_clicks_file(given.text, source=given.source).unconfirmed
    if unconfirmed is not None:
        print(
            f"note: {given.source}: nobody confirmed {len(unconfirmed.ids)} of these clicks: look at each",
            file=sys.stderr,
        )
    workspace.dispatch(ClicksImported.of(found.clicks))


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
    sure = tuple(one.assumption.words for one in recording.stated_assumptions if one.confirmed)
    if sure:
        workspace.dispatch(AssumptionsConfirmed(sure))


def _require_nothing_to_calibrate(recording: Recording, choice: Choice) -> None:
    """Say that there is no camera; refuse files that need one.

    Raises:
        UnusablePartError: a file of intrinsics, of a calibration or of clicks was given.
    """
    name, found = recording.paths[0].name, _unusable_pictures(recording)
    camera, clicks = choice.camera_file, choice.clicks
    given: dict[ChoicePart, str | Path | None] = {
        "camera": camera.source if camera else None,
        "calibration": choice.calibration_file,
        "clicks": clicks.source if clicks else None,
    }
    for part, file in given.items():
        if file:
            raise UnusablePartError(
                part, f"{name}: no pictures{found}, so {file} cannot be used; give the camera's recording as well"
            )
    print(f"{name}: no pictures{found}: showing the radar only. To calibrate, give the camera's recording as well.")


def _unusable_pictures(recording: Recording) -> str:
    """Return which image topics cannot be used and why, in brackets; "" if there are none."""
    problems = [
        f"{topic.name}: {topic.problem or 'has no messages'}" for topic in recording.topics if topic.kind == "image"
    ]
    return f" ({'; '.join(problems)})" if problems else ""
