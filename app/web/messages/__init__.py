"""The messages between the page and the server: text to commands, values to text.

A page's message is a JSON object with a "type" and, if it wants an answer, a "request" number. `python -m app.web.messages`
writes the types as TypeScript; `static/messages.d.ts` holds its output, and a test compares the two.
"""

from app.web.messages.incoming import (
    MAX_TEXT_BYTES,
    Command,
    CursorMoved,
    FrameWanted,
    Hello,
    ImportWanted,
    Incoming,
    ReturnColour,
    Viewpoint,
    ViewpointWanted,
    ViewWanted,
    parse,
    request_of,
)
from app.web.messages.outgoing import (
    Done,
    FrameHeader,
    Opening,
    Outgoing,
    Overlay,
    OverlayReturn,
    Problem,
    Progress,
    RecordingNote,
    SensorNote,
    SessionNote,
    StampColumns,
    encode,
    encode_frame,
)
from app.web.messages.radar_messages import PlacementRow, Placements, RadarLook, RadarMap, RadarReturn
from app.web.messages.view_changes import ClickChange, RowValues, ViewChange, change_between

__all__ = [
    "MAX_TEXT_BYTES",
    "ClickChange",
    "Command",
    "CursorMoved",
    "Done",
    "FrameHeader",
    "FrameWanted",
    "Hello",
    "ImportWanted",
    "Incoming",
    "Opening",
    "Outgoing",
    "Overlay",
    "OverlayReturn",
    "PlacementRow",
    "Placements",
    "Problem",
    "Progress",
    "RadarLook",
    "RadarMap",
    "RadarReturn",
    "RecordingNote",
    "ReturnColour",
    "RowValues",
    "SensorNote",
    "SessionNote",
    "StampColumns",
    "ViewChange",
    "ViewWanted",
    "Viewpoint",
    "ViewpointWanted",
    "change_between",
    "encode",
    "encode_frame",
    "parse",
    "request_of",
]
