import pytest

from service.schemas.problems import Problem


def refused(kind: str, match: str | None = None) -> pytest.RaisesExc[Problem]:
    """Expect a problem of a kind to be raised."""
    return pytest.raises(Problem, match=match, check=lambda problem: problem.kind == kind)
