"""Account for every byte of an SQLite database by walking through its trees page by page, independently of SQLite."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.recordings.containers.accounts import AccountBuilder, ByteKind, FileAccount, Progress
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch

_HEAD_BYTES = 100
_TABLE_LEAF, _TABLE_BRANCH, _INDEX_LEAF, _INDEX_BRANCH = 13, 5, 10, 2
_KINDS: tuple[ByteKind, ...] = ("unknown", "messages", "records", "index", "padding", "damaged")
_UNKNOWN, _MESSAGES, _RECORDS, _INDEX, _FREE, _DAMAGED = range(6)


@dataclass(frozen=True, slots=True)
class _Cell:
    """One row in a leaf: its number, its whole size, the part of it in the leaf, and its first overflow page."""

    row: int
    size: int
    local: bytes
    overflow: int


def account_for_database(file: FileBytes, progress: Progress | None) -> FileAccount:
    """Classify each page of a database as messages, other records, index, free or damaged.

    Args:
        file: the database, without the log beside it.
        progress: told how far the account is.
    """
    stretch = FileStretch(file, 0, file.size_bytes)
    builder = AccountBuilder(stretch, progress)
    pages = _Pages(file, builder)
    if pages.size:
        pages.walk_everything()
        for number in range(1, pages.count + 1):
            end = min(number * pages.size, file.size_bytes)
            kind = int(pages.kind[number])
            if kind == _UNKNOWN:
                builder.skip(end, "unknown")
            builder.claim(end, _KINDS[kind])
    return builder.done()


class _Pages:
    """The pages of a database and what each is used for.

    Args:
        file: the database.
        builder: takes the faults.
    """

    def __init__(self, file: FileBytes, builder: AccountBuilder) -> None:
        self._file = file
        self._builder = builder
        head = file.up_to(0, _HEAD_BYTES)
        size = int.from_bytes(head[16:18], "big") if len(head) == _HEAD_BYTES else 0
        self.size = 65536 if size == 1 else size if size >= 512 and not size & (size - 1) else 0
        self.usable = self.size - head[20] if self.size else 0
        self.count = -(-file.size_bytes // self.size) if self.size else 0
        declared = int.from_bytes(head[28:32], "big")
        self.kind = np.zeros(self.count + 1, dtype=np.uint8)
        if self.size and declared * self.size != file.size_bytes:
            builder.fault(
                f"its header declares {declared} pages of {self.size} bytes, but it has {file.size_bytes} bytes"
            )
        self._free = int.from_bytes(head[32:36], "big")

    def walk_everything(self) -> None:
        """Walk through the schema, the tables and indexes it names, and the free pages."""
        roots: list[tuple[bool, int]] = []
        for cell in self._rows(1, _RECORDS):
            values = _columns(self._payload(cell, _RECORDS), 4)
            if len(values) == 4 and isinstance(values[3], int) and values[3] > 0:
                roots.append((values[0] == b"table" and values[1] == b"messages", values[3]))
        for messages, root in roots:
            kind = _MESSAGES if messages else _RECORDS
            for cell in self._rows(root, kind):
                self._overflow(cell, kind)
        self._walk_free()

    def _claim(self, number: int, kind: int) -> bool:
        """Mark a page as used; False if it does not exist or something else uses it."""
        if not 1 <= number <= self.count or self.kind[number] != _UNKNOWN:
            self._builder.fault(f"page {number} is used twice or lies past the end of the file")
            return False
        self.kind[number] = kind
        return True

    def _page(self, number: int) -> bytes:
        return self._file.up_to((number - 1) * self.size, self.size)

    def _rows(self, root: int, kind: int) -> Iterator[_Cell]:
        """Yield the rows of a table, claiming the pages of its tree; an index has no rows of its own."""
        waiting = [root]
        while waiting:
            number = waiting.pop()
            if not self._claim(number, kind):
                continue
            page = self._page(number)
            head = _HEAD_BYTES if number == 1 else 0
            form = page[head] if len(page) == self.size else 0
            if form in (_INDEX_LEAF, _INDEX_BRANCH):
                self.kind[number] = _INDEX
            elif form not in (_TABLE_LEAF, _TABLE_BRANCH):
                self.kind[number] = _DAMAGED
                self._builder.fault(f"page {number} at byte {(number - 1) * self.size} is damaged or cut off")
                continue
            places = _cell_places(page, head, form)
            if form in (_TABLE_BRANCH, _INDEX_BRANCH):
                children = [int.from_bytes(page[place : place + 4], "big") for place in places]
                waiting.extend([int.from_bytes(page[head + 8 : head + 12], "big"), *reversed(children)])
            elif form == _TABLE_LEAF:
                yield from (cell for place in places if (cell := self._cell(page, place)) is not None)

    def _cell(self, page: bytes, place: int) -> _Cell | None:
        size, place = _varint(page, place)
        row, place = _varint(page, place)
        if size <= self.usable - 35:
            return _Cell(row, size, page[place : place + size], 0)
        least = (self.usable - 12) * 32 // 255 - 23
        local = least + (size - least) % (self.usable - 4)
        local = local if local <= self.usable - 35 else least
        overflow = int.from_bytes(page[place + local : place + local + 4], "big")
        return _Cell(row, size, page[place : place + local], overflow)

    def _overflow(self, cell: _Cell, kind: int) -> bytes:
        """Claim the overflow pages of a row; return the first of them."""
        left, number, first = cell.size - len(cell.local), cell.overflow, b""
        while left > 0 and self._claim(number, kind):
            page = self._page(number)
            first = first or page[4:]
            left -= self.usable - 4
            number = int.from_bytes(page[:4], "big")
        return first

    def _payload(self, cell: _Cell, kind: int) -> bytes:
        return cell.local + self._overflow(cell, kind)

    def _walk_free(self) -> None:
        """Claim the list of free pages."""
        number = self._free
        while number and self._claim(number, _FREE):
            page = self._page(number)
            count = int.from_bytes(page[4:8], "big")
            for place in range(8, min(8 + 4 * count, len(page) - 3), 4):
                self._claim(int.from_bytes(page[place : place + 4], "big"), _FREE)
            number = int.from_bytes(page[:4], "big")


def _cell_places(page: bytes, head: int, form: int) -> list[int]:
    count = int.from_bytes(page[head + 3 : head + 5], "big")
    start = head + (12 if form in (_TABLE_BRANCH, _INDEX_BRANCH) else 8)
    count = min(count, (len(page) - start) // 2)
    return list(struct.unpack_from(f">{count}H", page, start))


def _varint(data: bytes, place: int) -> tuple[int, int]:
    value = 0
    for number in range(9):
        byte = data[place + number] if place + number < len(data) else 0
        if number == 8:
            return value << 8 | byte, place + 9
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, place + number + 1
    raise AssertionError


def _columns(record: bytes, count: int) -> list[int | bytes]:
    """Return the first integers and texts of a record; fewer if it is damaged."""
    place = _varint(record, 0)[1]
    end = _varint(record, 0)[0]
    kinds: list[int] = []
    while place < min(end, len(record)) and len(kinds) < count:
        kind, place = _varint(record, place)
        kinds.append(kind)
    values: list[int | bytes] = []
    place = end
    for kind in kinds:
        size = (kind - 12) // 2 if kind >= 12 else (0, 1, 2, 3, 4, 6, 8, 8, 0, 0, 0, 0)[kind]
        data = record[place : place + size]
        values.append(data if kind >= 12 else int(kind == 9) if kind in (8, 9) else int.from_bytes(data, "big"))
        place += size
    return values
