"""Rejection of a whole result after the quality gate, for models of results and for plain dictionaries."""

from __future__ import annotations

from typing import TypedDict

from service.schemas.names import Verdict, refusal_uri


class CameraRefusal(TypedDict):
    """Members of a camera's result that a rejection of all poses changes."""

    accepted: bool
    rejected_because: str
    refusal: str | None


class ResultRefusal(TypedDict):
    """Members of a result, besides its cameras, that a rejection of all poses changes."""

    verdict: Verdict
    accepted: bool
    rejected_because: str


def refuse_camera(rejected_because: str | None, refusal: str | None, because: str, reason: str) -> CameraRefusal:
    """Reject a camera for one of `REFUSAL_REASONS`; a camera that is rejected already keeps its own reason."""
    return {
        "accepted": False,
        "rejected_because": rejected_because or because,
        "refusal": refusal if rejected_because else refusal_uri(reason),
    }


def refuse_result(rejected_because: str | None, because: str) -> ResultRefusal:
    """Reject a result, adding a reason to those that it has."""
    reasons = [because] if rejected_because is None else [rejected_because, because]
    return {
        "verdict": "rejected",
        "accepted": False,
        "rejected_because": "; ".join(one.removesuffix(".") for one in reasons),
    }
