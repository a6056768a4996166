"""What a pose rests on beside its pairs: unconfirmed clicks, a damaged recording, lost returns."""

from calib_core.results import DataWarning, UnconfirmedClicks

_NEARLY_SURE = 0.995


def probability_text(probability: float) -> str:
    """Write a probability with two digits; one that would round to 1 as "> 0.99"."""
    return "> 0.99" if probability >= _NEARLY_SURE else f"{probability:.2f}"


def nobody_confirmed(unconfirmed: UnconfirmedClicks, count: int) -> DataWarning:
    """Warn that clicks were placed automatically.

    Args:
        unconfirmed: which, and how sure they are.
        count: of all clicks that were used.
    """
    placed = len(unconfirmed.ids)
    of_all = f"all {count} clicks were" if placed == count else f"{placed} of {count} clicks were"
    return DataWarning(
        "nobody-confirmed",
        f"{of_all} placed automatically (confidence {probability_text(unconfirmed.confidence)}), and nobody confirmed them",
        "look at each of them on the page: open the recording with the clicks that solve --auto --clicks-out wrote",
    )


def damaged_recording(lost: int, damage: DataWarning) -> DataWarning:
    """Warn that clicks have no radar data in a recording that is damaged.

    Args:
        lost: how many clicks.
        damage: the recording's own warning.
    """
    clicks = "clicks have" if lost > 1 else "click has"
    return DataWarning(
        "damaged-recording",
        f"{lost} {clicks} no radar data, and the recording is damaged: {damage.message}",
        "copy the recording again from its source",
    )


def lost_returns(lost: int, read: int, where: str) -> DataWarning:
    """Warn that returns have no position although their messages do not mark them as invalid.

    Args:
        lost: how many.
        read: of how many.
        where: of what, such as "the radar around the clicks".
    """
    return DataWarning(
        "lost-returns",
        f"{lost} of {read} returns of {where} are lost ({100 * lost / read:.3g} %): their positions are not numbers or no "
        "ranges and angles, or their messages hold more returns than they state",
        "look for the fault in the radar's driver or in the program that wrote the recording; the reflector may be among them",
    )
