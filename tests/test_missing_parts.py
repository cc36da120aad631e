"""What the tests do on a machine that lacks something."""

import pytest

from tests import conftest


def test_what_a_machine_lacks_is_skipped_with_the_way_to_enable_it(missing, monkeypatch):
    monkeypatch.delenv("ESC_TEST_REQUIRE", raising=False)
    with pytest.raises(pytest.skip.Exception, match="apt-get install postgresql"):
        missing("postgres")


def test_what_must_not_be_missing_fails(missing, monkeypatch):
    monkeypatch.setenv("ESC_TEST_REQUIRE", "postgres,s3")
    with pytest.raises(pytest.fail.Exception, match="no s3 on this machine"):
        missing("s3")
    with pytest.raises(pytest.skip.Exception):
        missing("browser")


def test_a_misspelt_part_is_not_silently_optional(monkeypatch, pytestconfig):
    monkeypatch.setenv("ESC_TEST_REQUIRE", "s3, postgresql")
    with pytest.raises(pytest.UsageError, match="names postgresql; known are postgres, s3, colmap, promtool, browser"):
        conftest.pytest_configure(pytestconfig)
