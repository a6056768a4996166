"""What a pose rests on beside its pairs: unconfirmed clicks, a damaged recording, lost returns."""

from calib_core.results import DataWarning, UnconfirmedClicks


def unconfirmed_warning(unconfirmed: UnconfirmedClicks, count: int) -> DataWarning:
    """Warn that clicks were placed automatically.

    Args:
        unconfirmed: which, and how sure they are.
        count: of all clicks that were used.
    """
    return DataWarning(
        "nobody-confirmed",
        {"placed": len(unconfirmed.ids), "clicks": count, "confidence": unconfirmed.confidence},
    )


def damaged_recording(lost: int, damage: DataWarning) -> DataWarning:
    """Warn that clicks have no radar data in a recording that is damaged.

    Args:
        lost: how many clicks.
        damage: the recording's own warning.
    """
    return DataWarning("damaged-recording", {"lost": lost, "damage": damage})


def lost_returns(lost: int, read: int, where: str) -> DataWarning:
    """Warn that returns have no position although their messages do not mark them as invalid.

    Args:
        lost: how many.
        read: of how many.
        where: of what, such as "the radar around the clicks".
    """
    return DataWarning("lost-returns", {"lost": lost, "read": read, "where": where})
