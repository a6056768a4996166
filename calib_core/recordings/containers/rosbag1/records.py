"""The record header of a ROS 1 bag, version 2.0: name=value fields, each behind its length."""

import struct

_U32 = struct.Struct("<I")


def fields_of(raw: bytes) -> dict[str, bytes] | None:
    """Split a record header into its name=value fields; None where it is not one."""
    fields: dict[str, bytes] = {}
    place = 0
    while place + 4 <= len(raw):
        length = _U32.unpack_from(raw, place)[0]
        name, equals, value = raw[place + 4 : place + 4 + length].partition(b"=")
        if not equals or place + 4 + length > len(raw):
            return None
        fields[name.decode("ascii", "replace")] = value
        place += 4 + length
    return fields if place == len(raw) else None
