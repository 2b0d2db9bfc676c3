"""What tests of the coder have coded: numbers and decisions of several contexts."""

from collections.abc import Hashable, Sequence

from hypothesis import strategies as st

from mapweave.kernels.range_coder import Beginning, Coder

LIMIT = 2**21
BEGINNING: Beginning = {"a 0": (3, 21), "a 1 1": (20, 4), "b 2 sign": (1, 23), "d 1": (9, 15)}
CONTEXTS: Sequence[Hashable] = ("a", ("b", 2), ("b", True), (("c", 1), 2), "é")
NUMBERS = st.tuples(st.sampled_from(CONTEXTS), st.integers(-(2**60), 2**60))
SMALL = st.tuples(st.sampled_from(CONTEXTS), st.integers(-3, 3))
DECISIONS = st.tuples(st.sampled_from(["d", ("d", 1), ("d", False)]), st.booleans())
Step = tuple[Hashable, int]
STEPS = st.lists(NUMBERS | SMALL | DECISIONS, max_size=300)


def walk(coder: Coder, steps: Sequence[Step], *, known: bool = True) -> list[int]:
    """Code what `steps` are, numbers or decisions; return what came out."""
    found = []
    for context, number in steps:
        value = number if known else 0
        found.append((coder.bit if isinstance(number, bool) else coder.signed)(context, value))
        found.append(coder.even(value & 1))
    return found
