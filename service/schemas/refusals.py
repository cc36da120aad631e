"""Refusal of a result after the engine's gate has accepted it."""

from typing import TYPE_CHECKING

from service.schemas.names import refusal_uri

if TYPE_CHECKING:
    from service.schemas.results import Result


def refuse(result: "Result", because: str, reason: str = "all-or-none") -> "Result":
    """Return a result with every pose refused, for a reason of `REFUSAL_REASONS` (`service.schemas.problems`).

    The reasons that it was rejected for before stay.
    """
    cameras = [
        camera.model_copy(
            update={
                "accepted": False,
                "rejected_because": camera.rejected_because or because,
                "refusal": camera.refusal if camera.rejected_because else refusal_uri(reason),
            }
        )
        for camera in result.cameras
    ]
    reasons = [because] if result.rejected_because is None else [result.rejected_because, because]
    summary = "; ".join(one.removesuffix(".") for one in reasons)
    return result.model_copy(
        update={"verdict": "rejected", "accepted": False, "rejected_because": summary, "cameras": cameras}
    )
