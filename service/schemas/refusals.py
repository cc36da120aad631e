"""How a result is refused after all, whatever its gate said: for models of results and for plain ones."""

from __future__ import annotations

from typing import TypedDict

from service.schemas.names import Verdict, refusal_uri


class CameraRefusal(TypedDict):
    """Members of the answer about a camera that a refusal of all poses changes."""

    accepted: bool
    rejected_because: str
    refusal: str | None


class ResultRefusal(TypedDict):
    """Members of a result, beside its cameras, that a refusal of all poses changes."""

    verdict: Verdict
    accepted: bool
    rejected_because: str


def refuse_camera(rejected_because: str | None, refusal: str | None, because: str, reason: str) -> CameraRefusal:
    """Refuse a camera for one of `REFUSAL_REASONS`, unless it is refused already: `rejected_because`, `refusal`."""
    return {
        "accepted": False,
        "rejected_because": rejected_because or because,
        "refusal": refusal if rejected_because else refusal_uri(reason),
    }


def refuse_result(rejected_because: str | None, because: str) -> ResultRefusal:
    """Refuse a result, beside the reasons that it has already."""
    reasons = [because] if rejected_because is None else [rejected_because, because]
    return {
        "verdict": "rejected",
        "accepted": False,
        "rejected_because": "; ".join(one.removesuffix(".") for one in reasons),
    }
