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


_MOST_LOST, _MANY, _MOST = 0.05, 0.25, 0.5
"""Shares: of the time, and of the clicks, without radar data, as docs/warnings.md states (a choice)."""


def lost_data(
    *, clicks: int, without: int, touched: int, share: float, damage: DataWarning | None
) -> DataWarning | None:
    """Warn that radar data are lost where they matter; None if they are not.

    Args:
        clicks: how many clicks count.
        without: how many of them have no radar data.
        touched: how many have none, or not all in their windows.
        share: of the time without radar data.
        damage: the recording's own warning that it is damaged; None if it is whole.
    """
    if without > _MANY * clicks:
        most = without > _MOST * clicks
        facts = {"lost": without, "clicks": clicks, "damage": damage}
        return DataWarning("radar-mostly-missing" if most else "radar-missing", facts)
    if damage is None or not (touched or share > _MOST_LOST):
        return None
    return DataWarning("damaged-recording", {"lost": touched, "share": share, "damage": damage})


def lost_returns(lost: int, read: int, where: str) -> DataWarning:
    """Warn that returns have no position although their messages do not mark them as invalid.

    Args:
        lost: how many.
        read: of how many.
        where: of what, such as "the radar around the clicks".
    """
    return DataWarning("lost-returns", {"lost": lost, "read": read, "where": where})
