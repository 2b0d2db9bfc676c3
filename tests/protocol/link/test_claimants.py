from mapweave_protocol.link.claimants import Claimants


def test_one_that_is_heard_again_and_again_is_one() -> None:
    claimants = Claimants()
    assert [claimants.take("x", here=True) for _ in range(3)] == [0, 0, 0]
    assert [claimants.take("x", here=here) for here in (False, True)] == [0, 0]


def test_each_that_comes_beside_others_is_counted_once() -> None:
    claimants = Claimants()
    assert [claimants.take(boot, here=True) for boot in "xyyz"] == [0, 2, 0, 3]


def test_who_takes_over_is_not_too_many() -> None:
    claimants = Claimants()
    steps = [("x", True), ("x", False), ("y", True), ("x", False)]
    assert [claimants.take(boot, here=here) for boot, here in steps] == [0, 0, 0, 0]
