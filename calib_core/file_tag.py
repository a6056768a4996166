"""How a file shows that cocalib wrote it: a schema, a statement, or the tag in a comment or in its metadata."""

import re

TAG = "written by cocalib"
"""Where a file of ours states neither a schema nor what `statement` writes."""
OTHER_KIND = "cocalib"
_SCHEMA = re.compile(rb'\s*{\s*"schema": ?"(cocalib/[\w-]+)"')
_OURS = re.compile(
    TAG.encode()
    + rb"|: read it back with: cocalib check"  # exports
    + rb"|\ncocalib_evidence: "  # KITTI, whose files hold numbers only
    + rb'|\A{\s*"model": "\w+",\s*"width_px": '  # a camera alone
    + rb"|\Avehicle,session,recorded,status,verdict,"  # results of batch
    + rb'|<testsuites name="cocalib check">|!cocalib"|MAT-file, cocalib,'  # JUnit, Foxglove's layout, MATLAB
    + rb"|[\0-\x08\x0e-\x1f]cocalib"  # a length before it: the library of an MCAP file, the application of an .rrd
)


def kind_of(data: bytes) -> str:
    """Return which of our files this is: its schema, else OTHER_KIND; "" for a file of another program.

    Args:
        data: the file, or its beginning and its end.
    """
    schema = _SCHEMA.match(data)
    if schema:
        return schema[1].decode()
    return OTHER_KIND if _OURS.search(data) else ""
