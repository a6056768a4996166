"""The keys of a manifest."""

from typing import Annotated

from msgspec import Meta, Struct, field

from calib_core.interchange.vehicle_note import MOST_CHARACTERS
from calib_core.recordings import RecordingOptions

Name = Annotated[str, Meta(min_length=1, max_length=MOST_CHARACTERS)]


class SharedDocument(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What sessions can have in common."""

    vehicle_type: Name | None = None
    radar_serial: Name | None = None
    camera_serial: Name | None = None
    auto: bool = False
    camera: str | None = None
    rescale_camera: bool = False
    reflector_m: Annotated[float, Meta(ge=0.02, le=2.0)] = 0.24
    camera_position_m: tuple[float, float, float] | None = None
    camera_position_sigma_m: float | None = None
    exports: tuple[str, ...] = ()
    topics: RecordingOptions = field(default_factory=RecordingOptions)
    options: dict[str, object] = field(default_factory=dict)


class SessionDocument(SharedDocument, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One session of one vehicle; paths are relative to the manifest."""

    vehicle: Name
    recording: str | tuple[str, ...]
    session: Name | None = None
    clicks: str | None = None
    boxes: str | None = None


class ManifestDocument(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A manifest: its sessions, each a SessionDocument, and what they share unless they say otherwise."""

    session: tuple[dict[str, object], ...]
    defaults: SharedDocument = field(default_factory=SharedDocument)
