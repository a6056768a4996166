"""The text that `cocalib info --verify` prints."""

from collections.abc import Iterator

from calib_core.recordings.verification import FileCheck, TopicCheck, Verification

_BYTES = {
    "messages": "messages and their chunks",
    "records": "other records",
    "index": "index",
    "padding": "empty space",
    "damaged": "damaged",
    "unknown": "unknown",
}
_COUNTS = ("read", "unread", "unindexed", "damaged", "undecodable")


def verification_text(found: Verification) -> str:
    """Format a verification as text: bytes by file, messages by topic, the result last."""
    lines = [line for file in found.files for line in _file(file)]
    lines += ["", *_table(found), *_faults(found), ""]
    for warning in found.warnings:
        lines.append(f"warning   {warning.message}. [{warning.code}]")
    lines.append(f"result    {_result(found)}")
    return "\n".join(line.rstrip() for line in lines)


def _file(file: FileCheck) -> Iterator[str]:
    yield f"file      {file.name}, {file.size_bytes} bytes, {file.container}"
    shares = [(name, file.bytes_by.get(kind, 0)) for kind, name in _BYTES.items()]
    width = len(str(file.size_bytes))
    for name, count in shares:
        if count or name in ("damaged", "unknown"):
            yield f"            {count:>{width}} bytes: {name}"
    for fault in file.faults:
        yield f"            {fault}"


def _table(found: Verification) -> Iterator[str]:
    rows = [("topic", *_COUNTS), *((one.topic, *map(str, _counts(one))) for one in found.topics)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for name, *counts in rows:
        cells = [count.rjust(width) for count, width in zip(counts, widths[1:], strict=True)]
        yield "  ".join([name.ljust(widths[0]), *cells])


def _counts(one: TopicCheck) -> tuple[int, ...]:
    return one.read, one.unread, one.unindexed, one.damaged, one.undecodable


def _faults(found: Verification) -> Iterator[str]:
    for one in found.topics:
        if one.fault:
            yield f"  {one.topic}: {one.fault}"


def _result(found: Verification) -> str:
    if found.sound:
        return "sound: every byte is accounted for, and nothing is damaged or lost"
    sums = [sum(column) for column in zip(*map(_counts, found.topics), strict=True)] or [0] * len(_COUNTS)
    named = [
        f"{count} messages {name}" for name, count in zip(_COUNTS, sums, strict=True) if count and name in _COUNTS[2:]
    ]
    damaged = sum(file.bytes_by.get("damaged", 0) for file in found.files)
    named += [f"{damaged} bytes damaged"] if damaged else []
    return f"not sound: {', '.join(named) or 'see above'}; everything else is read"
