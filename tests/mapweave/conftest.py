"""What the library's tests share."""

import numpy as np
import pytest


@pytest.fixture
def rng() -> np.random.Generator:
    """Return a generator that gives every test, in every run, the same numbers."""
    return np.random.default_rng(20260)
