"""Convert the provenance of a calibration to and from its document in calibration-1."""

from msgspec import UNSET, UnsetType

from calib_core.interchange.calibration_file import AssumptionNote, Provenance
from calib_core.interchange.own import documents
from calib_core.interchange.own.unconfirmed_document import unconfirmed_document, unconfirmed_of
from calib_core.results import InputFile


def provenance_document(provenance: Provenance) -> documents.ProvenanceDocument:
    """Return the document of a provenance."""
    return documents.ProvenanceDocument(
        inputs=[documents.InputDocument(f.name, f.size_bytes, f.sha256) for f in provenance.inputs],
        topics=documents.TopicsDocument(
            provenance.radar_topic,
            provenance.image_topic,
            provenance.camera_info_topic,
            radar_all=list(provenance.radar_topics) if len(provenance.radar_topics) > 1 else UNSET,
            radar_choice=provenance.radar_choice or UNSET,
        ),
        clocks=documents.ClocksDocument(provenance.radar_clock, provenance.image_clock),
        radar_axes=provenance.radar_axes,
        video_start=provenance.video_start,
        version=provenance.version,
        column_map=list(provenance.column_map) or UNSET,
        assumptions=[documents.AssumptionDocument(one.text, one.confirmed) for one in provenance.assumptions] or UNSET,
        unconfirmed=unconfirmed_document(provenance.unconfirmed),
    )


def provenance_of(document: documents.ProvenanceDocument) -> Provenance:
    """Return the provenance in a document."""
    return Provenance(
        inputs=tuple(InputFile(f.name, f.size_bytes, f.sha256) for f in document.inputs),
        radar_topic=document.topics.radar,
        radar_topics=_radar_topics(document.topics),
        radar_choice=document.topics.radar_choice or "",
        image_topic=document.topics.image,
        camera_info_topic=document.topics.camera_info,
        radar_clock=document.clocks.radar,
        image_clock=document.clocks.image,
        radar_axes=document.radar_axes,
        video_start=document.video_start,
        version=document.version,
        column_map=tuple(document.column_map or ()),
        assumptions=tuple(AssumptionNote(one.text, one.confirmed) for one in document.assumptions or ()),
        unconfirmed=unconfirmed_of(document.unconfirmed),
    )


def _radar_topics(topics: documents.TopicsDocument) -> tuple[str, ...]:
    if not isinstance(topics.radar_all, UnsetType):
        return tuple(topics.radar_all)
    return () if topics.radar is None else (topics.radar,)
