"""Parameters of tests, of which `make test` tries some and `make test-long` the others."""

from collections.abc import Iterable

import pytest


def try_first(values: Iterable, count: int = 1) -> list:
    """Return values for `pytest.mark.parametrize` of which all but the first ones carry the mark `long`.

    A tuple is one value for each of several names.
    """
    return [value if number < count else _long(value) for number, value in enumerate(values)]


def _long(value):
    several = value if isinstance(value, tuple) else (value,)
    return pytest.param(*several, marks=pytest.mark.long)
