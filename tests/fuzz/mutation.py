"""Change an input a little: the usual mutations of a fuzzer, from a given source of randomness."""

import random
import struct
from collections.abc import Callable, Sequence

_INTERESTING = (0, 1, -1, 127, 128, 255, 32767, 65535, 2**31 - 1, -(2**31), 2**32 - 1, 2**63 - 1)
_WORDS = (
    b"nan",
    b"-inf",
    b"1e308",
    b"-0",
    b"9" * 30,
    b"null",
    b"[",
    b"{",
    b'"\\ud800"',
    b"\xff\xfe",
    b"\0",
    b"\n",
    b"../",
)


def mutated(data: bytes, others: Sequence[bytes], tokens: Sequence[bytes], rng: random.Random, most: int) -> bytes:
    """Return a changed copy, not longer than `most` bytes.

    Args:
        data: the input.
        others: the corpus, to take pieces from.
        tokens: words of the input's language.
        rng: the source of randomness.
        most: bytes.
    """
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 1, 2, 4, 8))):
        rng.choice(_MUTATIONS)(changed, others, tokens, rng)
    return bytes(changed[:most])


def _place(data: bytearray, rng: random.Random) -> int:
    """Choose a place, often near the ends: that is where heads and indexes are."""
    size = len(data)
    near = rng.choice((size, size, min(size, 64), -min(size, 64)))
    return rng.randrange(near) if near > 0 else max(0, size - 1 - rng.randrange(-near)) if near < 0 else 0


def _flip(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    if data:
        data[_place(data, rng)] ^= 1 << rng.randrange(8)


def _byte(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    if data:
        data[_place(data, rng)] = rng.randrange(256)


def _overwrite(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    place = _place(data, rng)
    piece = rng.randbytes(rng.choice((1, 2, 4, 8)))
    data[place : place + len(piece)] = piece


def _number(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    """Write an interesting number, or change the one that stands there by a little."""
    code, size = rng.choice((("<H", 2), ("<I", 4), (">I", 4), ("<Q", 8)))
    place = _place(data, rng)
    if place + size > len(data):
        return
    (value,) = struct.unpack_from(code, data, place)
    value = rng.choice(_INTERESTING) if rng.random() < 0.5 else value + rng.randint(-35, 35)
    struct.pack_into(code, data, place, value % (1 << (8 * size)))


def _digits(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    """Replace a run of digits by another number."""
    places = [n for n, byte in enumerate(data[:4096]) if 48 <= byte <= 57]
    if places:
        first = rng.choice(places)
        last = first
        while last < len(data) and 48 <= data[last] <= 57:
            last += 1
        data[first:last] = str(rng.choice((*_INTERESTING, rng.randrange(10_000)))).encode()


def _delete(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    place = _place(data, rng)
    del data[place : place + rng.choice((1, 2, 8, 64, 4096))]


def _repeat(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    place = _place(data, rng)
    piece = bytes(data[place : place + rng.choice((1, 4, 16, 64, 256))])
    data[place:place] = piece * rng.choice((1, 1, 2, 20))


def _insert(data: bytearray, _others: Sequence[bytes], tokens: Sequence[bytes], rng: random.Random) -> None:
    place = _place(data, rng)
    data[place:place] = rng.choice((*tokens, *_WORDS))


def _replace(data: bytearray, _others: Sequence[bytes], tokens: Sequence[bytes], rng: random.Random) -> None:
    """Put one word of the language in the place of another."""
    standing = [token for token in tokens if token in data]
    if standing:
        old = rng.choice(standing)
        place = data.find(old)
        data[place : place + len(old)] = rng.choice((*tokens, *_WORDS))


def _splice(data: bytearray, others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    """Take over a piece of another input."""
    other = rng.choice(others) if others else b""
    if other:
        first = rng.randrange(len(other))
        place = _place(data, rng)
        piece = other[first : first + rng.choice((4, 16, 256, len(other)))]
        data[place : place + (len(piece) if rng.random() < 0.5 else 0)] = piece


def _cut(data: bytearray, _others: Sequence[bytes], _tokens: Sequence[bytes], rng: random.Random) -> None:
    del data[_place(data, rng) :]


_Mutation = Callable[[bytearray, Sequence[bytes], Sequence[bytes], random.Random], None]
_MUTATIONS: tuple[_Mutation, ...] = (
    _flip, _byte, _byte, _overwrite, _number, _number, _digits, _delete, _repeat, _insert, _replace, _splice, _cut,
)  # fmt: skip
