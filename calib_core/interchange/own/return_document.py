"""Convert a chosen return to and from its document in clicks-1 and calibration-1."""

from calib_core.interchange.own.documents import ReturnDocument, TimeDocument
from calib_core.measurements import ChosenReturn, time_from_parts, time_parts


def return_document(chosen: ChosenReturn) -> ReturnDocument:
    """Return the document of a chosen return."""
    time = None if chosen.radar_time is None else TimeDocument(*time_parts(chosen.radar_time))
    return ReturnDocument(chosen.position_m, time, chosen.topic)


def chosen_of(document: ReturnDocument) -> ChosenReturn:
    """Return the chosen return of a JSON object."""
    time = document.radar_time
    return ChosenReturn(
        document.position_m, None if time is None else time_from_parts(time.sec, time.nanosec), document.topic
    )
