import httpx
import pytest

from service.schemas.problems import Problem


def refused(kind: str, match: str | None = None) -> pytest.RaisesExc[Problem]:
    """Expect a problem of a kind to be raised."""
    return pytest.raises(Problem, match=match, check=lambda problem: problem.kind == kind)


def problem_of(answer: httpx.Response) -> tuple[int, str]:
    """Status and kind of the problem that a request was answered with."""
    assert answer.headers["content-type"] == "application/problem+json"
    return answer.status_code, answer.json()["type"].removeprefix("/problems/")
