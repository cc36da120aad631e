"""Why a camera's pose is refused: a stable word for each reason, what it looks like, and what to do."""

from __future__ import annotations

from dataclasses import dataclass

DOCUMENT = "docs/refused.md"


@dataclass(frozen=True)
class Reason:
    """One reason: what holds, what a person sees, what helps, and the part of `docs/refused.md` about it."""

    title: str
    looks_like: str
    do: str
    anchor: str


# The last part of a refusal's address. These names are part of the interface: add some, change none.
REASONS: dict[str, Reason] = {
    "view": Reason(
        "The frame shows too little of the field",
        "A dark, blinded, fogged, snowy, smeared or blocked picture.",
        "Free, clean, light or focus the view, and send the next frame.",
        "the-view-cannot-be-used",
    ),
    "lines": Reason(
        "The markings in the frame are not where the pose puts them",
        "The blue drawing lies beside the lines, or half of them cannot be seen.",
        "See that it is the right camera and field, and that the stored pose is near; list what else is painted on the "
        "ground in the field's other_markings.",
        "the-lines",
    ),
    "few-lines": Reason(
        "Too few points of lines can be measured",
        "Hardly any lines in the view, or faint, far and soft ones.",
        "Turn the camera so that it sees more of the field; see to light and focus.",
        "the-lines",
    ),
    "residual": Reason(
        "Lines are beside where the pose puts them",
        "The blue drawing crosses the lines.",
        "Read the diagnosis and what is said of the markings; calibrate the lens or measure the field again.",
        "the-lines",
    ),
    "zoomed": Reason(
        "Zoom or focus have moved",
        "Nothing: a zoom and a move along the view look alike.",
        "Set the zoom back, accept pose and intrinsics by hand, or let the venue's lens be may-drift.",
        "the-pose",
    ),
    "undetermined": Reason(
        "The visible lines do not determine the pose",
        "Lines of one direction only, or all of them far away.",
        "Let the camera see lines in more than one direction, some of them near; calibrate its lens again.",
        "the-pose",
    ),
    "moved": Reason(
        "The pose is too far from the stored one",
        "Somebody moved the camera, or the drawing lies on lines that look alike.",
        "Accept the pose by hand where the drawing is right; else store a first pose that is nearer.",
        "the-pose",
    ),
    "stored-better": Reason(
        "The stored pose fits the frame better",
        "Orange on the lines and blue beside them.",
        "Nothing when it happens once; when often, calibrate the lens or measure the field again.",
        "the-pose",
    ),
    "not-together": Reason(
        "Two views cannot be brought together",
        "Two fields in the stitched preview.",
        "Find out in the overlays which camera is off.",
        "the-cameras-together",
    ),
    "disagree": Reason(
        "Two cameras put the same markings apart",
        "Doubled lines at the seam.",
        "See where along the seam they are apart; check both lenses and the ridge.",
        "the-cameras-together",
    ),
    "ridge": Reason(
        "The ridge that was found cannot be one",
        "Nothing: the views do not tell the ridge.",
        "Calibrate without fit_ridge.",
        "the-venue",
    ),
    "venue-changed": Reason(
        "The venue was changed while the job ran",
        "Lens, field or poses were put, restored or accepted meanwhile.",
        "Send the frames again.",
        "the-venue",
    ),
    "all-or-none": Reason(
        "The poses are accepted together or not at all",
        "This camera is right, another one is refused.",
        "See to the other cameras, or let the venue accept each.",
        "refused-and-what-now",
    ),
}


def address_of(reason: str) -> str:
    """The address that a result names: the service itself answers it with an explanation."""
    return f"/refusals/{reason}"
