"""Which robot of a pair compares their maps: a rule that both can compute."""

import zlib


def ordered(a: str, b: str) -> tuple[str, str]:
    """Return two robots as reference and other, the same whoever asks."""
    return (a, b) if a <= b else (b, a)


def responsible(a: str, b: str) -> str:
    """Return the one of two robots that compares their maps; a checksum spreads the work."""
    pair = ordered(a, b)
    return pair[zlib.crc32("/".join(pair).encode()) % 2]
