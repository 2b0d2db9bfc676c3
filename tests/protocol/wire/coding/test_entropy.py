"""What the coder begins with is what is usual in maps."""

from collections.abc import Callable, Hashable

from mapweave.kernels.range_coder import PythonEncoder, name_of
from mapweave.maps import RobotMap
from mapweave_protocol.wire.coding.entropy import MAX_NUMBERS, usual
from mapweave_protocol.wire.coding.trajectory_code import Clock
from mapweave_protocol.wire.geometry import PackedSubmap

MakeMap = Callable[..., RobotMap]


def test_the_counts_that_are_usual_are_of_contexts_that_maps_have(random_map: MakeMap) -> None:
    found = set[str]()

    class Named(PythonEncoder):
        def bit(self, context: Hashable, value: int = 0) -> int:
            found.add(name_of(context))
            return super().bit(context, value)

    for seed in range(20):
        for submap in random_map(seed).submaps:
            PackedSubmap.code(Named(usual(), MAX_NUMBERS), PackedSubmap.pack(submap), Clock())
    kinds = {name.split()[0] for name in usual()}
    assert {name.split()[0] for name in found} <= kinds
    assert all(zeros > 0 and ones > 0 for zeros, ones in usual().values())
