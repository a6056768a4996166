"""`cocalib solve --propose`: where the reflector probably stands in the images, for a person or a script to confirm."""

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

from calib_core.input_files import name_text
from calib_core.options import CalibrationOptions, checked_options
from cocalib.cli.output import explain_unsolvable, recorded_clicks, shown_progress, tell_choices
from cocalib.cli.recording_flags import CameraFlags, RecordedFlags, checked_reflector_m
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from calib_core.measurements import ReflectorClick
    from calib_core.proposing import DwellView, Proposals
    from calib_core.recordings import Recording


@dataclass(frozen=True, slots=True)
class Shown:
    """Where proposals go: to a file (cocalib/proposals-1), and to the terminal as a table or as the same JSON."""

    out: "Path | None"
    json: bool


def propose(
    recorded: RecordedFlags,
    options: CalibrationOptions,
    shown: Shown,
    *,
    camera: CameraFlags,
    clicks_file: "Path | None",
    reflector_m: float,
) -> int:
    """Find the proposals and print them; return the exit code.

    Nothing is accepted by it; the page shows the same proposals to confirm with a key.

    Args:
        recorded: the recording.
        options: of a calibration.
        shown: where they go.
        camera: intrinsics.
        clicks_file: of those that a person placed: one shows what the reflector looks like.
        reflector_m: width of the reflector as the camera sees it.
    """
    from calib_core.measurements import Unsolvable
    from cocalib.proposing import find_proposals
    from cocalib.solving.recorded_clicks import file_of_clicks, require_confirmed
    from cocalib.solving.solving import required_camera

    options = checked_options(options)
    reflector_m = checked_reflector_m(reflector_m)
    camera_file = camera.read()
    clicks: tuple[ReflectorClick, ...] = () if clicks_file is None else file_of_clicks(clicks_file).clicks
    with recorded.open() as recording:
        require_confirmed(recording)
        tell_choices(recording)
        lens = required_camera(recording, camera_file)
        if clicks_file is not None:
            clicks = recorded_clicks(clicks, recording, lens, source=clicks_file)
        with shown_progress() as progress:
            found = find_proposals(
                recording, lens, options, confirmed=clicks, reflector_m=reflector_m, progress=progress
            )
        if isinstance(found, Unsolvable):
            return explain_unsolvable(found, what="no proposals")
        if not found[1].ranked and not any(click.counts for click in clicks):
            return _explain_nothing(found[1], recording)
        return _deliver(shown, *found, recording, clicks, reflector_m)


def _explain_nothing(proposals: "Proposals", recording: "Recording") -> int:
    """Print to stderr why no placement is proposed; return 1."""
    from calib_core.measurements import TimeNs, Unsolvable
    from cocalib.cli.proposal_table import unproposed_lines

    print("\n".join(unproposed_lines(proposals, TimeNs(int(recording.image_times[0])))), file=sys.stderr)
    nothing = Unsolvable("nothing-proposed", {"placements": len(proposals.unproposed)})
    return explain_unsolvable(nothing, what="no proposals")


def _deliver(
    shown: Shown,
    views: "Sequence[DwellView]",
    proposals: "Proposals",
    recording: "Recording",
    clicks: "Sequence[ReflectorClick]",
    reflector_m: float,
) -> int:
    """Print the proposals, and write them to the file if one is given; return the exit code."""
    from calib_core.measurements import TimeNs
    from calib_core.proposing.proposals import ProposalSource, proposals_json
    from cocalib.cli.proposal_table import proposal_lines

    for slip in proposals.slips:
        print(
            f"warning: click {slip.click} is {slip.off_px:.0f} px beside what is probably the reflector: look at it again",
            file=sys.stderr,
        )
    confirmed = tuple(click.id for click in clicks if click.counts)
    source = ProposalSource(
        recording=tuple(name_text(path.name) for path in recording.paths),
        image_topic=recording.image_topic,
        radar_topics=recording.radar_topics,
        reflector_m=reflector_m if proposals.chance is None else reflector_m * proposals.chance.wider,
        confirmed=confirmed,
    )
    text = proposals_json(proposals, views, source)
    if shown.json:
        print_exactly(text)
    else:
        print("\n".join(proposal_lines(proposals, views, TimeNs(int(recording.image_times[0])), confirmed)))
    if shown.out is not None:
        write_whole(shown.out, text)
        print(f"written to {shown.out}", file=sys.stderr if shown.json else sys.stdout)
    return 0
