"""`cocalib solve --propose`: where the reflector probably stands in the images, for a person or a script to confirm."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.association.placements import Placement
from calib_core.input_files import name_text
from calib_core.interchange.own.proposal_documents import PROPOSALS_SCHEMA, ProposalsDocument
from calib_core.measurements import NS_PER_S, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, checked_options
from calib_core.proposing import DwellView, Proposals
from calib_core.proposing.proposals import named_proposals, proposals_json
from calib_core.recordings import Recording, table_lines
from calib_core.words.warnings import probability_text
from cocalib.cli.output import explain_unsolvable, recorded_clicks, shown_progress, tell_choices
from cocalib.cli.recording_flags import CameraFlags, RecordedFlags, checked_reflector_m
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import print_exactly
from cocalib.proposing import find_proposals
from cocalib.solving.recorded_clicks import file_of_clicks, require_confirmed
from cocalib.solving.solving import required_camera

_HEAD = ("id", "time [s]", "range [m]", "column [px]", "row [px]", "sigma [px]", "confidence", "reason")


@dataclass(frozen=True, slots=True)
class Shown:
    """Where proposals go: to a file (cocalib/proposals-1), and to the terminal as a table or as the same JSON."""

    out: Path | None
    json: bool


def propose(
    recorded: RecordedFlags,
    options: CalibrationOptions,
    shown: Shown,
    *,
    camera: CameraFlags,
    clicks_file: Path | None,
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


def _explain_nothing(proposals: Proposals, recording: Recording) -> int:
    """Print to stderr why no placement is proposed; return 1."""
    print("\n".join(_unproposed_lines(proposals, TimeNs(int(recording.image_times[0])))), file=sys.stderr)
    nothing = Unsolvable("nothing-proposed", {"placements": len(proposals.unproposed)})
    return explain_unsolvable(nothing, what="no proposals")


def _deliver(
    shown: Shown,
    views: Sequence[DwellView],
    proposals: Proposals,
    recording: Recording,
    clicks: Sequence[ReflectorClick],
    reflector_m: float,
) -> int:
    """Print the proposals, and write them to the file if one is given; return the exit code."""
    for slip in proposals.slips:
        print(
            f"warning: click {slip.click} is {slip.off_px:.0f} px beside what is probably the reflector: look at it again",
            file=sys.stderr,
        )
    confirmed = tuple(click.id for click in clicks if click.counts)
    source = ProposalsDocument(
        schema=PROPOSALS_SCHEMA,
        recording=[name_text(path.name) for path in recording.paths],
        image_topic=recording.image_topic,
        radar_topics=list(recording.radar_topics),
        reflector_m=reflector_m if proposals.chance is None else reflector_m * proposals.chance.wider,
        confirmed=list(confirmed),
        proposals=[],
        unproposed=[],
    )
    text = proposals_json(proposals, views, source)
    if shown.json:
        print_exactly(text)
    else:
        print("\n".join(_proposal_lines(proposals, views, TimeNs(int(recording.image_times[0])), confirmed)))
    if shown.out is not None:
        write_whole(shown.out, text)
        print(f"written to {shown.out}", file=sys.stderr if shown.json else sys.stdout)
    return 0


def _proposal_lines(
    proposals: Proposals, views: Sequence[DwellView], origin: TimeNs, confirmed: Sequence[str] = ()
) -> list[str]:
    """Return the proposals, the most confident first, and what could not be proposed.

    Args:
        proposals: of these views.
        views: of all placements of a recording.
        origin: stamp of its first frame; times count from there.
        confirmed: ids of the clicks that were given.
    """
    rows = [
        (
            name,
            f"{_seconds(one.image_time, origin):.1f}",
            f"{_range_m(one.placement):.1f}",
            f"{one.pixel_px[0]:.1f}",
            f"{one.pixel_px[1]:.1f}",
            f"{one.sigma_px:.1f}",
            probability_text(one.confidence),
            one.reason,
        )
        for name, one in named_proposals(proposals, views, confirmed)
    ]
    return [
        *(table_lines([_HEAD, *rows], right=range(1, len(_HEAD) - 1)) if rows else []),
        *_unproposed_lines(proposals, origin),
        _summary(proposals, confirmed),
    ]


def _unproposed_lines(proposals: Proposals, origin: TimeNs) -> list[str]:
    """Return a line for each placement that could not be proposed: when, where and why not."""
    return [
        f"not proposed: the placement from {_seconds(placement.start, origin):.1f} to {_seconds(placement.end, origin):.1f} s, "
        f"{_range_m(placement):.1f} m away: {reason}"
        for placement, reason in proposals.unproposed
    ]


def _summary(proposals: Proposals, confirmed: Sequence[str]) -> str:
    """Say how many there are, and how far images and radar agree."""
    count = len(proposals.ranked)
    said = f"{count} {'proposal' if count == 1 else 'proposals'}, nobody has confirmed {'it' if count == 1 else 'them'} yet"
    if not count:
        said = "no proposals"
    if confirmed:
        said += f"; {len(confirmed)} {'click was' if len(confirmed) == 1 else 'clicks were'} given as confirmed"
    if proposals.agreement is not None:
        agreement, rival = (100.0 * share for share in (proposals.agreement.share, proposals.agreement.rival_share))
        said += f"; images and radar agree on one mounting by {agreement:.0f} %, on another by {rival:.0f} %"
    return said


def _seconds(time: TimeNs, origin: TimeNs) -> float:
    return (int(time) - int(origin)) / NS_PER_S


def _range_m(placement: Placement) -> float:
    return float(np.linalg.norm(placement.position_radar_m))
