"""What the page can choose from: the radars, cameras, intrinsics and session of a recording, with what is known about them."""

from dataclasses import replace
from pathlib import Path

import calib_core.recordings as recordings
from calib_core.errors import CalibrationError
from calib_core.input_files import name_text
from calib_core.recordings import Recording, TopicSummary
from cocalib.opening.choice import Choice
from cocalib.opening.opened import Opened
from cocalib.opening.sessions import session_offer
from cocalib.solving.solving import intrinsics_near
from cocalib.web.messages import OpeningChoices, TopicRow


def choices_of(choice: Choice, opened: Opened) -> OpeningChoices:
    """Describe what can be chosen instead of what is open."""
    workspace = opened.workspace
    described = _described(choice, opened.recording)
    folder = workspace.restored.folder if workspace.facts.has_pictures else None
    return replace(
        described,
        is_open=True,
        radar_topic=choice.topics.radar_topic,
        image_topic=choice.topics.image_topic,
        intrinsics=workspace.intrinsics,
        intrinsics_file=workspace.given.file is not None,
        session=session_offer(choice, workspace.facts, folder),
    )


def choices_after(choice: Choice, problem: str) -> OpeningChoices:
    """Describe what can be chosen after a recording could not be opened as chosen.

    Args:
        choice: how it was to be opened.
        problem: why that failed, in sentences.
    """
    session = session_offer(choice, None, None)
    nothing = OpeningChoices(0, choice.title, problem, session=session, intrinsics_near=_near(choice))
    plain = replace(choice.topics, radar_topic=None, image_topic=None, camera_info_topic=None)
    try:
        with recordings.inspect_recording(choice.paths, plain) as recording:
            return replace(_described(choice, recording), problem=problem, session=session)
    except (CalibrationError, OSError):  # `problem` says what is wrong with it
        return nothing


def _described(choice: Choice, recording: Recording) -> OpeningChoices:
    return OpeningChoices(
        question=0,
        name=choice.title,
        radars=_radars(recording),
        radar_reason=recording.radar_choice,
        cameras=tuple(_row(topic) for topic in recording.topics if topic.kind == "image"),
        intrinsics=_intrinsics(choice, recording),
        recorded_intrinsics=recording.camera() is not None,
        intrinsics_near=_near(choice),
    )


def _intrinsics(choice: Choice, recording: Recording) -> str:
    """Say which intrinsics would be used; "" if there are none."""
    if choice.camera_file is not None:
        return name_text(Path(choice.camera_file.source).name)
    return (recording.camera_info_topic or "the recording") if recording.camera() is not None else ""


def _near(choice: Choice) -> str:
    near = intrinsics_near(choice.paths)
    return near.name if near is not None else ""


def _radars(recording: Recording) -> tuple[TopicRow, ...]:
    """List the radars, the one in use first; topics that are one radar are one row, if they have been compared."""
    topics = [topic for topic in recording.topics if topic.kind == "radar"]
    if len(topics) < 2:
        return tuple(map(_row, topics))
    compared = recording.radar_sensors
    rows = [
        TopicRow(sensor.name, recordings.figures_text(sensor.figures), used=number == 0)
        for number, sensor in enumerate(compared)
    ]
    known = {name for sensor in compared for name in (*sensor.topics, *sensor.copies)}
    return (*rows, *(_row(topic) for topic in topics if topic.name not in known))


def _row(topic: TopicSummary) -> TopicRow:
    rate = "" if topic.rate_hz is None else f" at {topic.rate_hz:.1f} Hz"
    problem = topic.problem or ("" if topic.count else "it has no messages")
    layout = f", {topic.layout}" if topic.layout else ""
    return TopicRow(topic.name, f"{topic.count} messages{rate}, {topic.type}{layout}", topic.chosen, problem)
