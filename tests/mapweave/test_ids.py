"""A robot's or team's name is ``[a-z0-9][a-z0-9_-]{0,31}``, and nothing else is."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.errors import InvalidIdError
from mapweave.ids import ID_PATTERN, check_id

RULE = re.compile(r"[a-z0-9][a-z0-9_-]{0,31}")


@given(st.from_regex(RULE, fullmatch=True))
def test_what_follows_the_rule_is_handed_back(name: str) -> None:
    assert check_id("robot", name) == name


@given(st.text(alphabet="abz09_-AZ./* \n\0é", max_size=40))
def test_what_breaks_the_rule_is_refused(name: str) -> None:
    if RULE.fullmatch(name):
        assert check_id("robot", name) == name
        return
    with pytest.raises(InvalidIdError):
        check_id("robot", name)


@pytest.mark.parametrize(
    "name", ["", "-a", "_a", "A", "a b", "a/b", "a*", "a\n", "ä", "a" * 33, "..", "@live"]
)
def test_names_that_would_break_keys_or_files_are_refused(name: str) -> None:
    with pytest.raises(InvalidIdError):
        check_id("robot", name)


@pytest.mark.parametrize("name", [None, 1, b"a", ["a"]])
def test_what_is_no_text_is_no_name(name: str) -> None:
    with pytest.raises(InvalidIdError):
        check_id("robot", name)


def test_the_message_is_one_line_that_names_the_kind_the_name_and_the_rule() -> None:
    with pytest.raises(InvalidIdError) as caught:
        check_id("team", "Bad\nName")
    assert str(caught.value) == (
        "team 'Bad\\nName': expected 1 to 32 characters, lower-case letters, digits, '_' or '-',"
        " the first a letter or digit"
    )
    assert (caught.value.kind, caught.value.name) == ("team", "Bad\nName")


def test_the_pattern_for_others_is_the_same_rule() -> None:
    assert re.search(ID_PATTERN, "a-1_b") and not re.search(ID_PATTERN, "a/b")
