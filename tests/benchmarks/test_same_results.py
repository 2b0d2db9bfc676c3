"""What counts as a difference between the results of two commits."""

import pytest

from benchmarks.same_results import differences, part_of

OLD = {
    "boot": "x",
    "submaps": [{"pose": [0.0, 1.0, 2.0], "polylines": [[[0.0, 0.0, 1.0, 0.0]]], "support": [[2]]}],
}


def altered(**changes: object) -> dict[str, object]:
    return {"boot": "x", "submaps": [{**OLD["submaps"][0], **changes}]}  # type: ignore[dict-item]


@pytest.mark.parametrize("new", [OLD, {**OLD, "boot": "y"}, altered(kind="wall")])
def test_who_made_it_and_fields_that_are_new_are_no_difference(new: object) -> None:
    assert list(differences(OLD, new)) == []


@pytest.mark.parametrize(
    ("changes", "path", "part"),
    [
        ({"pose": [0.0, 1.0, 2.0 + 1e-15 * 4]}, "submaps[0].pose[2]", "poses"),
        ({"support": [[3]]}, "submaps[0].support[0][0]", "support"),
        ({"support": [[2, 2]]}, "submaps[0].support[0]", "support"),
        ({"polylines": []}, "submaps[0].polylines", "segments"),
    ],
)
def test_a_number_that_differs_in_its_last_bit_or_is_missing_is_a_difference_of_its_part(
    changes: dict[str, object], path: str, part: str
) -> None:
    assert list(differences(OLD, altered(**changes))) == [path]
    assert part_of(path) == part


def test_a_field_that_is_gone_is_a_difference() -> None:
    new = altered()
    new["submaps"] = [{"pose": [0.0, 1.0, 2.0]}]
    assert sorted(differences(OLD, new)) == ["submaps[0].polylines", "submaps[0].support"]


@pytest.mark.parametrize(
    ("path", "part"),
    [
        ("alignments[0].transform[1]", "alignments"),
        ("components[0].robots.a/0[2]", "poses"),
        ("submaps[2].trajectory[4][2]", "trajectories"),
        ("components[1].free_space[0]", "rest"),
    ],
)
def test_a_difference_belongs_to_the_part_that_its_path_names(path: str, part: str) -> None:
    assert part_of(path) == part
