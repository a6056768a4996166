"""`cocalib propose`: where the reflector probably stands in the pictures, for a person or a script to confirm."""

import sys
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.options import CalibrationOptions, checked_options
from cocalib.cli.flags import File, Switch
from cocalib.cli.output import explain_unsolvable, recorded_clicks, shown_progress, tell_choices, write_whole
from cocalib.cli.recording_flags import (
    CameraFlags,
    GivenCamera,
    OptionFlags,
    Options,
    Recorded,
    RecordedFlags,
    checked_reflector_m,
)
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from collections.abc import Sequence

    from calib_core.measurements import ReflectorClick
    from calib_core.proposing import DwellView, Proposals
    from calib_core.recordings import Recording


@dataclass(frozen=True, slots=True)
class Propose:
    """Find where the reflector probably stands in the pictures, for a person or a script to confirm.

    Nothing is accepted by that; the page shows the same proposals to confirm with a key.
    """

    NAMED = CalibrationOptions

    clicks: File = None
    """Clicks that a person placed (cocalib/clicks-1 JSON): one shows what the reflector looks like."""
    camera: GivenCamera = field(default_factory=CameraFlags)
    reflector_m: float = 0.24
    """Width of the reflector as the camera sees it [m]."""
    json: Switch = False
    """Print everything as JSON (cocalib/proposals-1)."""
    out: File = None
    """Write the same JSON to this file."""
    recorded: Recorded = field(default_factory=RecordedFlags)
    options: Options = field(default_factory=OptionFlags)

    def run(self) -> int:
        """Find the proposals and print them; return the exit code."""
        from calib_core.measurements import Unsolvable
        from cocalib.proposing import find_proposals
        from cocalib.solving.recorded_clicks import file_of_clicks, require_confirmed
        from cocalib.solving.solving import required_camera

        options = checked_options(self.options.all())
        reflector_m = checked_reflector_m(self.reflector_m)
        self._require_folder()
        camera_file = self.camera.read()
        clicks: tuple[ReflectorClick, ...] = () if self.clicks is None else file_of_clicks(self.clicks).clicks
        with self.recorded.open() as recording:
            require_confirmed(recording)
            tell_choices(recording)
            camera = required_camera(recording, camera_file)
            if self.clicks is not None:
                clicks = recorded_clicks(clicks, recording, camera, source=self.clicks)
            with shown_progress() as progress:
                found = find_proposals(
                    recording, camera, options, confirmed=clicks, reflector_m=reflector_m, progress=progress
                )
            if isinstance(found, Unsolvable):
                return explain_unsolvable(found, what="no proposals")
            if not found[1].ranked and not any(click.counts for click in clicks):
                return self._explain_nothing(found[1], recording)
            return self._deliver(*found, recording, clicks)

    def _require_folder(self) -> None:
        """Refuse an output file that cannot be written, before the search.

        Raises:
            InputError: its folder is missing.
        """
        if self.out is not None and not self.out.absolute().parent.is_dir():
            raise InputError(f"{self.out}: the folder {self.out.parent} does not exist; create it first")

    def _explain_nothing(self, proposals: "Proposals", recording: "Recording") -> int:
        """Print to stderr why no placement is proposed; return 1."""
        from calib_core.measurements import TimeNs, Unsolvable
        from cocalib.cli.proposal_table import unproposed_lines

        print("\n".join(unproposed_lines(proposals, TimeNs(int(recording.image_times[0])))), file=sys.stderr)
        nothing = Unsolvable(
            "nothing-proposed",
            f"none of the {len(proposals.unproposed)} placements shows where in the picture the reflector stood",
            "check that both recordings are of the same time, the intrinsics, --reflector-m and --radar-axes; or give a click "
            "with --clicks: it shows what the reflector looks like",
        )
        return explain_unsolvable(nothing, what="no proposals")

    def _deliver(
        self,
        views: "Sequence[DwellView]",
        proposals: "Proposals",
        recording: "Recording",
        clicks: "Sequence[ReflectorClick]",
    ) -> int:
        """Print the proposals, and write them to the file if one is given; return the exit code."""
        from calib_core.measurements import TimeNs
        from calib_core.proposing.proposals import ProposalSource, proposals_json
        from cocalib.cli.proposal_table import proposal_lines
        from cocalib.proposing import beside_the_reflector

        for click in clicks:
            if click.counts and (off_px := beside_the_reflector(click, views)) is not None:
                print(
                    f"warning: click {click.id} is {off_px:.0f} px from everything that changed then, and a reflector is seen "
                    "elsewhere: look at it again; nothing is learned from it",
                    file=sys.stderr,
                )
        confirmed = tuple(click.id for click in clicks if click.counts)
        source = ProposalSource(
            recording=tuple(name_text(path.name) for path in recording.paths),
            image_topic=recording.image_topic,
            radar_topics=recording.radar_topics,
            reflector_m=self.reflector_m,
            confirmed=confirmed,
        )
        text = proposals_json(proposals, views, source)
        if self.json:
            print_exactly(text)
        else:
            print("\n".join(proposal_lines(proposals, views, TimeNs(int(recording.image_times[0])), confirmed)))
        if self.out is not None:
            write_whole(self.out, text)
            print(f"written to {self.out}", file=sys.stderr if self.json else sys.stdout)
        return 0
