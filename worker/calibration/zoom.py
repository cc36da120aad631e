"""Cameras whose zoom or focus has moved: the focal length that the lines say, and the pose with it.

Where lines and movement contradict the focal length beyond doubt, the pose that was found with it is wrong, and a
better one is known. Whether that may be stored is the venue's choice: a lens that was screwed tight has not moved, and
then something else is wrong.
"""

from __future__ import annotations

from dataclasses import replace

from worker.calibration.finish.diagnosis import is_sure
from worker.calibration.judge.quality import CameraResult, Refusal, zoom_in_words, zoomed_beyond_doubt
from worker.calibration.scene.camera import Camera
from worker.calibration.settle import Settled, Situation, settle_without

MOST_ROUNDS = 5
LEAST_SIGMAS = 2.0
"""A change that is found has to be so many of its sigmas."""
ARRIVED = 0.25
"""Of its sigma: a focal length that changes less has been found."""
WHAT_TO_DO = (
    "zoom or focus have moved. Pose and intrinsics of the answer fit the lines: accept the job by hand to store both, "
    "let the venue's lens be may-drift, or set the zoom back"
)


def refit_zoomed(here: Situation, settled: Settled) -> Settled:
    """The same, but those cameras that zoomed are where their lines put them with another focal length.

    What they say of their neighbours with the old one is wrong: the others are finished without them.
    """
    asking = [number for number, result in enumerate(settled.results) if _asks_for_it(here, result)]
    found = {number: _refitted(here, number, settled.results[number]) for number in asking}
    refitted = {number: result for number, result in found.items() if result is not None}
    settled = settle_without(refitted, here, settled)
    return replace(settled, results=[refitted.get(n, result) for n, result in enumerate(settled.results)])


def _asks_for_it(here: Situation, result: CameraResult) -> bool:
    """A lens that may drift is followed as soon as it is seen to; another one must be wrong beyond doubt."""
    if here.options.lens_may_drift and result.accepted:
        return result.zoom is not None and is_sure(result.zoom)
    return zoomed_beyond_doubt(result, here.gate)


def _refitted(here: Situation, number: int, result: CameraResult) -> CameraResult | None:
    """A camera by itself with the focal length that its lines say, None where even that does not pass the gate."""
    stored, found = here.cameras[number], result
    for _ in range(MOST_ROUNDS):
        zoom, likelier = found.zoom, found.likelier
        if zoom is None or likelier is None:
            return None
        changed_px = likelier.intrinsics.focal_length_px - stored.intrinsics.focal_length_px
        if abs(zoom.value) >= ARRIVED * zoom.sigma:
            # Until it is found it may be off by all that it has changed.
            found = _with_lens(here, number, likelier, abs(changed_px))
            continue
        found = _with_lens(here, number, likelier, zoom.sigma)
        if abs(changed_px) < LEAST_SIGMAS * zoom.sigma:
            # With another focal length the lines say less of it than they did before.
            return None
        change = replace(zoom, value=changed_px)
        moved = Refusal("zoomed", f"{zoom_in_words(stored, change)}: {WHAT_TO_DO}")
        refusal = None if here.options.lens_may_drift else moved
        return replace(found, zoom=change, refusal=refusal, lens_found=True) if found.accepted else None
    return None


def _with_lens(here: Situation, number: int, begun: Camera, sigma_px: float) -> CameraResult:
    """What becomes of a camera by itself with the lens it has begun with, whose focal length is known to so much."""
    lens = replace(begun.intrinsics, sigma={**here.cameras[number].intrinsics.sigma, "fx": sigma_px})
    alone = here.by_itself(number)
    alone = replace(alone, cameras=[replace(here.cameras[number], intrinsics=lens)])
    return alone.judged(alone.finished([replace(begun, intrinsics=lens)]))[0]
