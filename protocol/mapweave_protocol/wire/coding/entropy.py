"""The coder of whole numbers as the wire uses it: what it begins with, and how much it takes."""

from functools import cache
from importlib.resources import files

from mapweave.kernels.range_coder import Beginning, Coder, Encoder, make_decoder, make_encoder

MAX_NUMBERS = 2**21  # of a stream


def encoder() -> Encoder:
    """Return an encoder that begins with what is usual in maps."""
    return make_encoder(usual(), MAX_NUMBERS)


def decoder(data: bytes) -> Coder:
    """Return a decoder that does so as well."""
    return make_decoder(data, usual(), MAX_NUMBERS)


@cache
def usual() -> Beginning:
    """Return by name of context with which counts of 0 and 1 it begins; others begin with 1, 1."""
    text = files(__package__).joinpath("usual.txt").read_text(encoding="ascii")
    rows = (line.rsplit(maxsplit=2) for line in text.splitlines())
    return {name: (int(zeros), int(ones)) for name, zeros, ones in rows}
