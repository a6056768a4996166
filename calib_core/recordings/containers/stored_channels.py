"""A channel exactly as a file stores it, for copying: schema bytes, encoding names and the recorder's notes."""

from dataclasses import dataclass

ChannelNotes = tuple[tuple[str, str], ...]
"""What a recorder notes of a channel besides its type, by key: quality of service, latching, the publisher's name."""


@dataclass(frozen=True, slots=True)
class StoredChannel:
    """One topic of one publisher, in the words of MCAP.

    Attributes:
        topic: its name.
        encoding: serialisation of the messages, such as "ros1" or "cdr".
        schema_name: the message type; "" for messages without a schema.
        schema_encoding: the language of the definition, such as "ros2msg"; "" if there is none.
        schema_data: the definition, byte for byte.
        notes: the recorder's notes.
    """

    topic: str
    encoding: str
    schema_name: str = ""
    schema_encoding: str = ""
    schema_data: bytes = b""
    notes: ChannelNotes = ()
