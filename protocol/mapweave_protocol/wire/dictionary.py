"""What messages are full of, so that it need not travel: a preset dictionary for deflate.

Its checksum is in each body that uses it (RFC 1950, 2.2), so whoever has another one notices. A
change of it is a change of the wire's version.
"""

import msgpack

_NUMBERS = (
    "reach", "place", "spread", "parts", "residual", "contradicted", "complexity", "held",
    "overlap", "score", "common",
)  # fmt: skip
_RIVAL = ("rival_common", "rival_contradicted", "distance", "turn", "confidence", "tolerance")
_WORDS = (
    "others_contradict", "maps_contradict", "maps_contradict_jointly", "undecided", "rebased",
    "small_reference", "small_other", "no_shape", "little_common", "contradicted", "parallel",
    "straight", "rival", "unsure", "parts_agree", "bent", "met_before", "min_wall", "convincing",
    "revoked", "held", "set_aside", "relied_on", "refused", "ambiguous", "accepted",
    "map", "alignment", "status", "finished", "mapping",
)  # fmt: skip


def _names(names: tuple[str, ...]) -> bytes:
    return b"".join(msgpack.packb(name) for name in names)


DICTIONARY = _names(_WORDS) + _names(_RIVAL) + _names(_NUMBERS)
