"""What is accepted where nothing is right: without a reflector, and with images and radar of different recordings."""

from collections.abc import Mapping

from benchmarks.accuracy.rows import Figures
from benchmarks.intrinsics.tables import Table
from benchmarks.proposing.tables import limit_95, summed
from benchmarks.proposing.without_reflector import measure_real, real_recordings

__all__ = ["drives_table", "mismatched_table", "real_table"]


def drives_table(kept: Mapping[int, Figures]) -> Table:
    """Tell what is found where no reflector stands."""
    trials = [trial for trial in kept.values() if trial]
    accepted = int(summed(trials, "accepted"))
    row = (
        str(len(trials)),
        f"{summed(trials, 'placements'):.0f}",
        f"{summed(trials, 'proposed'):.0f}",
        f"{max((trial['surest'] or 0.0 for trial in trials), default=0.0):.2f}",
        limit_95(accepted, len(trials)) if any("accepted" in trial for trial in trials) else "-",
    )
    head = (
        "drives",
        "dwells that the radar shows",
        "proposed to a person",
        "highest confidence",
        "accepted by --auto",
    )
    return Table("Without a reflector", head, (row,), _DRIVES)


_DRIVES = """Parked cars and a fence with walkers; a road with cars; swaying branches; an aisle with robots; a person who goes
from place to place and stands there as with a reflector, but has none. The aim: nothing is accepted, in 20 drives."""


def mismatched_table(kept: Mapping[int, Figures], recordings: int) -> Table:
    """Tell whether anything is accepted of images and radar that do not belong together."""
    rows = []
    for words, own in (("radar of another recording", 0.0), ("radar of the same recording, dwells shifted", 1.0)):
        trials = [trial for trial in kept.values() if trial and trial["own"] == own]
        accepted = limit_95(int(summed(trials, "accepted")), len(trials))
        rows.append((words, str(len(trials)), accepted))
    head = ("images of one recording with", "pairs", "accepted by --auto")
    return Table("Images and radar that do not belong together", head, tuple(rows), _MISMATCHED.format(recordings))


_MISMATCHED = """The dwells are matched in order of time, so that the images show a reflector for each: a harder case than
images of other times, in which nothing stands. Only dwells of true placements take part. The pairs
come of {} recordings, so that they are not independent of each other, as the limit supposes. The aim: 0 in 1,000 pairs of at
least 40 recordings."""


def real_table() -> Table:
    """Tell what is found in the real recordings next to the checkout."""
    rows = []
    for path in real_recordings():
        found = measure_real(path)
        if isinstance(found, str):
            continue
        accepted = "yes" if found["accepted"] else "nothing"
        rows.append((path.name, f"{found['placements']:.0f}", f"{found['proposed']:.0f}", accepted))
    head = ("recording", "dwells that the radar shows", "proposed", "accepted by --auto")
    return Table(
        "Real recordings without a reflector", head, tuple(rows), "The other recordings lack a radar or a camera."
    )
