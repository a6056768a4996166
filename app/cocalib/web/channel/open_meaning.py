"""What a calibration can mean that does not state it, for the page: rows to pick from, and each drawn over a frame."""

from dataclasses import dataclass
from urllib.parse import parse_qs

from calib_core.errors import InputError
from calib_core.recordings import Recording
from cocalib.hypothesis_sheet import OpenMeaning, frame_with_returns, jpeg, tile

_WIDTH_PX = 480


@dataclass(frozen=True, slots=True)
class MeaningRow:
    """One meaning to pick.

    Attributes:
        meaning: its key, to be sent back.
        place: of the numbers in the file, to be sent back.
        score: its share among all, in words.
        words: what the numbers mean.
        mounting: where the camera is, and where it looks.
        is_shown: the calibration is shown with it.
    """

    meaning: str
    place: str
    score: str
    words: str
    mounting: str
    is_shown: bool


@dataclass(frozen=True, slots=True)
class MeaningRows:
    """The meanings of a calibration.

    Attributes:
        name: of its file; "" if there is no calibration that leaves it open.
        rows: the likeliest first.
    """

    name: str
    rows: tuple[MeaningRow, ...]


def meaning_rows(meaning: OpenMeaning | None) -> MeaningRows:
    """Return what the page can pick from."""
    if meaning is None:
        return MeaningRows("", ())
    rows = (
        MeaningRow(
            offer.hypothesis.key,
            offer.place,
            offer.hypothesis.score,
            offer.hypothesis.meanings[0].words,
            offer.hypothesis.mounting,
            is_shown=number == meaning.shown,
        )
        for number, offer in enumerate(meaning.offers)
    )
    return MeaningRows(meaning.name, tuple(rows))


def drawn_meaning(meaning: OpenMeaning | None, recording: Recording, query: str) -> bytes:
    """Return a frame with the returns where one meaning puts them, as JPEG.

    Args:
        meaning: what can be picked.
        recording: with the frame.
        query: number of the row, and index of the frame: "number=0&frame=12".

    Raises:
        InputError: there is no such row or frame.
        RecordingError: the frame cannot be read.
    """
    given = parse_qs(query)
    number, index = (_whole_number(given.get(name, [""])[0]) for name in ("number", "frame"))
    if meaning is None or not 0 <= number < len(meaning.offers) or not 0 <= index < len(recording.image_times):
        raise InputError("there is no such meaning or frame; reload the page")
    frame = frame_with_returns(recording, meaning.camera, index)
    return jpeg(tile(frame, meaning.offers[number].hypothesis, _WIDTH_PX))


def _whole_number(text: str) -> int:
    return int(text) if text.isascii() and text.isdigit() and len(text) < 10 else -1
