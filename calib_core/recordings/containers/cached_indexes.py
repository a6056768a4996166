"""Store indexes and message heads in the cache as arrays, and restore them."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from calib_core.recordings.containers.index_cache import FileCache
from calib_core.recordings.containers.sources import Channel, Heads, MessageIndex

_FEWEST_HEADS = 500


@dataclass(frozen=True, slots=True, eq=False)
class KeptIndex:
    """The result of opening a chunked file.

    Attributes:
        channels: the topics it declares.
        chunks: (n, 3) position, stored bytes, uncompressed bytes.
        compressions: (n,) compression names.
        indexes: by channel.
    """

    channels: tuple[Channel, ...]
    chunks: np.ndarray
    compressions: tuple[str, ...]
    indexes: Mapping[int, MessageIndex]


def keep_index(cache: FileCache, kept: KeptIndex) -> None:
    """Store an index in the cache."""
    names = sorted(set(kept.compressions))
    words = {"channels": [asdict(channel) for channel in kept.channels], "compressions": names}
    ids = list(kept.indexes)
    columns = [np.stack([i.receive_ns, i.chunk, i.offset]) for i in kept.indexes.values()]
    cache.put(
        "index",
        {
            "words": np.frombuffer(json.dumps(words).encode(), dtype=np.uint8),
            "chunks": kept.chunks,
            "compression": np.array([names.index(name) for name in kept.compressions], dtype=np.int64),
            "ids": np.array(ids, dtype=np.int64),
            "counts": np.array([len(index) for index in kept.indexes.values()], dtype=np.int64),
            "columns": np.concatenate(columns, axis=1) if columns else np.zeros((3, 0), dtype=np.int64),
        },
    )


def index_from(cache: FileCache) -> KeptIndex | None:
    """Return the index from the cache; None if there is no valid one."""
    arrays = cache.get("index")
    if arrays is None:
        return None
    try:
        words = json.loads(arrays["words"].tobytes())
        channels = tuple(Channel(**fields) for fields in words["channels"])
        names = tuple(words["compressions"][number] for number in arrays["compression"].tolist())
        edges = np.concatenate([[0], np.cumsum(arrays["counts"])])
        receive_ns, chunk, offset = arrays["columns"].astype(np.int64)
        chunks = arrays["chunks"].astype(np.int64).reshape(-1, 3)
        if edges[-1] != len(chunk) or len(names) != len(chunks):
            return None
        if len(chunk) and not 0 <= int(chunk.min()) <= int(chunk.max()) < len(chunks):
            return None
        indexes = {
            int(number): MessageIndex(receive_ns[first:last], chunk[first:last], offset[first:last])
            for number, first, last in zip(arrays["ids"], edges[:-1], edges[1:], strict=True)
        }
    except (KeyError, ValueError, TypeError, IndexError):
        return None
    return KeptIndex(channels, chunks, names, indexes)


def keep_heads(cache: FileCache | None, index: MessageIndex, size: int, heads: Heads) -> None:
    """Store heads in the cache if they are many and all were read."""
    if cache is not None and len(index) >= _FEWEST_HEADS and not heads.fault:
        cache.put(_heads_name(index, size), {"rows": heads.rows, "lengths": heads.lengths})


def heads_from(cache: FileCache | None, index: MessageIndex, size: int) -> Heads | None:
    """Return the heads of exactly these messages from the cache; None if they are not cached."""
    if cache is None or len(index) < _FEWEST_HEADS:
        return None
    arrays = cache.get(_heads_name(index, size))
    if arrays is None or not {"rows", "lengths"} <= arrays.keys():
        return None
    rows, lengths = arrays["rows"], arrays["lengths"]
    fits = rows.shape == (len(index), size) and rows.dtype == np.uint8 and lengths.shape == (len(index),)
    return Heads(rows, lengths.astype(np.int64)) if fits and lengths.dtype.kind == "i" else None


def _heads_name(index: MessageIndex, size: int) -> str:
    digest = hashlib.sha1(str(size).encode(), usedforsecurity=False)
    for column in _columns(index):
        digest.update(np.ascontiguousarray(column).tobytes())
    return f"heads-{digest.hexdigest()[:20]}"


def _columns(index: MessageIndex) -> Sequence[np.ndarray]:
    return index.chunk, index.offset
