"""The committed corpus: inputs that once were findings, one file each, in a folder per target."""

from pathlib import Path

FOLDER = Path(__file__).parent / "corpus"


def corpus_of(target: str) -> list[bytes]:
    """Return the committed inputs of a target."""
    return [path.read_bytes() for path in sorted((FOLDER / target).glob("*.bin"))]
