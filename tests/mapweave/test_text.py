"""What others wrote is shown on one line, and cut."""

from hypothesis import given
from hypothesis import strategies as st

from mapweave.text import shown


@given(st.text(max_size=300), st.integers(2, 200))
def test_what_is_shown_is_printable_and_no_longer_than_the_limit(text: str, limit: int) -> None:
    line = shown(text, limit)
    assert line.isprintable()
    assert len(line) <= limit


@given(st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=120))
def test_plain_text_is_shown_as_it_is(text: str) -> None:
    assert shown(text) == text


def test_what_moves_a_cursor_is_shown_as_its_code_and_what_is_cut_says_so() -> None:
    assert shown("a\nb\x1b[0m\u202ec") == "a\\nb\\x1b[0m\\u202ec"
    assert shown("x" * 121) == "x" * 119 + "…"
    assert shown("\n" * 60) == "\\n" * 60
    assert shown("\n" * 61).endswith("…")
