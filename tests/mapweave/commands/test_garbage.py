"""What is loaded before a robot maps is not looked through again and again."""

import gc

import pytest

from mapweave.commands.garbage import spared


def test_what_is_there_is_spared_while_a_block_lasts_and_collected_afterwards() -> None:
    assert gc.get_freeze_count() == 0
    with spared():
        assert gc.get_freeze_count() > 0
    assert gc.get_freeze_count() == 0


def test_a_block_that_fails_gives_back_what_was_spared() -> None:
    with pytest.raises(ValueError, match="why"), spared():
        raise ValueError("why")
    assert gc.get_freeze_count() == 0
