"""How much a message may make of the bytes that came, known before any of it is made.

Few bytes of msgpack, fewer still compressed, can stand for millions of objects. So the bytes are
walked once, nothing being made of them, and what is too much is refused: what a message costs is
bounded by a multiple of its own bytes, and by a limit of its kind.
"""

from dataclasses import dataclass

MAX_DEPTH = 16  # of arrays and maps in each other; reasons about reasons come to 12
BYTES_OF_A_BYTE = 32  # decompressed: ours come to 20
BYTES_OF_NONE = 64 * 2**10
OBJECTS_OF_A_BYTE = 16  # of the payload: ours come to 3
OBJECTS_OF_NONE = 4096


KIB, MIB = 2**10, 2**20


@dataclass(frozen=True, slots=True)
class Budget:
    """What a kind of message may come to.

    Attributes
    ----------
    payload
        The most bytes as they travel.
    body
        The most bytes decompressed.
    objects
        The most numbers, texts, arrays and maps, each counted.
    """

    payload: int
    body: int
    objects: int

    def body_of(self, received: int) -> int:
        """Return how many bytes may come of `received` ones."""
        return min(self.body, BYTES_OF_NONE + BYTES_OF_A_BYTE * received)

    def objects_of(self, received: int) -> int:
        """Return how many objects may come of `received` bytes."""
        return min(self.objects, OBJECTS_OF_NONE + OBJECTS_OF_A_BYTE * received)


def check_objects(data: bytes, most: int) -> None:
    """Check that the msgpack `data` has no more objects than so many, and no depth to speak of.

    What is no msgpack passes, as far as it goes: whoever reads it will find out.

    Raises
    ------
    ValueError
        If it has.
    """
    left, position, end = most - 1, 0, len(data)
    here, around = 1, list[int]()  # objects to come in the container, and in those around it
    while position < end:
        size, children = _PLAIN[data[position]]
        if size:  # most of what a message holds
            position += size
        else:
            position, children = _step(data, position)
        here -= 1
        if children:
            if children > left:
                raise ValueError(f"more than {most} objects")
            left -= children
            around.append(here)
            here = children
            if len(around) > MAX_DEPTH:
                raise ValueError(f"more than {MAX_DEPTH} arrays and maps in each other")
        while not here:
            if not around:
                return
            here = around.pop()


def _step(data: bytes, position: int) -> tuple[int, int]:
    """Return where the next object begins, and how many this one holds, by the count it tells."""
    first = data[position]
    if first in _COUNTED:
        size, width = _COUNTED[first]
        return position + 1 + width + size + _number(data, position + 1, width), 0
    width, parts = _CONTAINERS[first]
    return position + 1 + width, parts * _number(data, position + 1, width)


# Bytes after those that tell the length, and how many these are: bin, ext, str.
_COUNTED = {
    0xC4: (0, 1), 0xC5: (0, 2), 0xC6: (0, 4),
    0xC7: (1, 1), 0xC8: (1, 2), 0xC9: (1, 4),
    0xD9: (0, 1), 0xDA: (0, 2), 0xDB: (0, 4),
}  # fmt: skip
# Bytes that tell how many there are, and objects for each: arrays, maps.
_CONTAINERS = {0xDC: (2, 1), 0xDD: (4, 1), 0xDE: (2, 2), 0xDF: (4, 2)}
# Bytes that follow: floats, integers, fixed extensions.
_FIXED = {
    0xCA: 4, 0xCB: 8, 0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8, 0xD0: 1, 0xD1: 2, 0xD2: 4, 0xD3: 8,
    0xD4: 2, 0xD5: 3, 0xD6: 5, 0xD7: 9, 0xD8: 17,
}  # fmt: skip


def _plain(first: int) -> tuple[int, int]:
    """Return how many bytes an object takes that begins with `first`, and how many it holds.

    No bytes where a count that follows tells.
    """
    if first in _COUNTED or first in _CONTAINERS:
        return 0, 0
    if 0x80 <= first < 0xA0:  # small maps and arrays, whose parts follow
        return 1, (first & 0x0F) * (2 if first < 0x90 else 1)
    if 0xA0 <= first < 0xC0:  # short texts
        return 1 + (first & 0x1F), 0
    return 1 + _FIXED.get(first, 0), 0


_PLAIN = tuple(map(_plain, range(256)))


def _number(data: bytes, position: int, width: int) -> int:
    return int.from_bytes(data[position : position + width], "big")
