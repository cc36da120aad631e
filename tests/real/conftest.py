"""The real pair; its tests are skipped where it is missing."""

import pytest

from testbed.real_pair import FOLDER, RealPair


@pytest.fixture(scope="session")
def real_pair() -> RealPair:
    if not FOLDER.is_dir():
        pytest.skip(f"the real pair is not there: put it into {FOLDER} to run this test")
    return RealPair.load()
