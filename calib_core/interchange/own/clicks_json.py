"""Write and read clicks-1, the file of a session's clicks, with chosen returns and clicks that nobody confirmed."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from msgspec import UNSET

from calib_core.interchange.own.documents import (
    CLICKS_SCHEMA,
    ClickDocument,
    ClicksDocument,
    refuse_repeated_ids,
    unconfirmed_of,
)
from calib_core.interchange.syntax.strict_json import document_text, parse_document
from calib_core.measurements import ReflectorClick
from calib_core.results import UnconfirmedClicks


@dataclass(frozen=True, slots=True)
class ClicksFile:
    """The content of a clicks-1 file.

    Attributes:
        clicks: sorted by time.
        unconfirmed: those of them that nobody confirmed; None if a person placed or confirmed all.
    """

    clicks: tuple[ReflectorClick, ...]
    unconfirmed: UnconfirmedClicks | None = None


def read_clicks(text: str, source: str = "clicks") -> tuple[ReflectorClick, ...]:
    """Read clicks-1 text; the clicks are sorted by time.

    Args:
        text: the file's content.
        source: the name of the file in error messages.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    return read_clicks_file(text, source).clicks


def read_clicks_file(text: str, source: str = "clicks") -> ClicksFile:
    """Read clicks-1 text with what it says of its clicks.

    Args:
        text: the file's content.
        source: the name of the file in error messages.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    document = parse_document(text, ClicksDocument, source=source)
    refuse_repeated_ids([click.id for click in document.clicks], source=source, place="clicks")
    clicks = tuple(sorted(map(click_of, document.clicks)))
    return ClicksFile(clicks, unconfirmed_of(document.unconfirmed, [click.id for click in clicks]))


def write_clicks(
    clicks: Iterable[ReflectorClick],
    *,
    radar_topics: Sequence[str] = (),
    unconfirmed: UnconfirmedClicks | None = None,
) -> str:
    """Write clicks as clicks-1 text, sorted by time; the same clicks give the same bytes.

    Args:
        clicks: in any order.
        radar_topics: of the radar they were made with; written only if there are several, for whoever reads the file.
        unconfirmed: those that nobody confirmed.
    """
    stated = [click_document(click) for click in sorted(clicks, key=lambda click: (click.image_time, click.id))]
    topics = list(radar_topics) if len(radar_topics) > 1 else UNSET
    return document_text(ClicksDocument(CLICKS_SCHEMA, stated, radar_topics=topics, unconfirmed=unconfirmed or UNSET))


def click_of(document: ClickDocument) -> ReflectorClick:
    """Return the click of a JSON object."""
    return ReflectorClick(
        image_time=document.image_time,
        id=document.id,
        u_px=document.pixel_px[0],
        v_px=document.pixel_px[1],
        sigma_px=document.sigma_px,
        excluded=document.excluded,
        mark=document.mark,
        chosen=document.chosen,
    )


def click_document(click: ReflectorClick) -> ClickDocument:
    """Return the document of a click."""
    return ClickDocument(
        click.id,
        click.image_time,
        (click.u_px, click.v_px),
        sigma_px=click.sigma_px,
        excluded=click.excluded,
        mark=click.mark,
        chosen=click.chosen,
    )
