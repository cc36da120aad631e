"""Kinds of jobs: each has options and a title."""

from typing import get_args

from service.pages.formatting import KINDS
from service.schemas.names import JobKind
from service.store.jobs.task import OPTIONS


def test_every_kind_has_options_of_its_own_and_a_title():
    assert set(OPTIONS) == set(KINDS) == set(get_args(JobKind))
    assert len(set(OPTIONS.values())) == len(OPTIONS)
