"""Write a session again from what its files prove, with the old ones kept as backups."""

from cocalib.platform.resources import version
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.identity import RecordingForm
from cocalib.session.file.journal import begin_journal
from cocalib.session.file.journal_reading import JOURNAL
from cocalib.session.file.reconciling import Contents
from cocalib.session.file.snapshot import SNAPSHOT, write_snapshot


def rewrite(
    folder: GuardedFolder, found: Contents, recording: RecordingForm
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Replace journal and snapshot by what was proven; a process killed on the way leaves files that agree.

    Returns:
        the names of the backups, and the checksums of the new journal's lines.

    Raises:
        SessionFileError: a file is not a regular file of this user.
        OSError: something cannot be written; what was not replaced stays.
    """
    backups = tuple(kept for name in (JOURNAL, SNAPSHOT) if (kept := folder.back_up(name)) is not None)
    continues = found.snapshot.sum if found.snapshot else ""
    sums = begin_journal(folder, recording, found.steps, cocalib=version(), continues=continues)
    write_snapshot(folder, found.history.present, recording=recording, sums=sums, cocalib=version())
    return backups, sums
