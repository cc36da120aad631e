"""Problems that requests about venues and jobs are refused with, in the store and in the routes."""

from service.schemas.history import Revision
from service.schemas.job import Job
from service.schemas.problems import Problem
from service.schemas.venue import Camera, Venue

# While a job is open.
RETRY_AFTER_S = 2


def no_such_venue(venue_id: str) -> Problem:
    """Problem of a request about a venue that is not stored."""
    return Problem("venue-not-found", f"PUT /venues/{venue_id} creates it; GET /venues lists those there are.")


def camera_of(venue: Venue, camera_id: str) -> Camera:
    """Return a camera of a venue; raises the problem `no-such-camera`."""
    for camera in venue.cameras:
        if camera.id == camera_id:
            return camera
    ids = [camera.id for camera in venue.cameras]
    raise Problem(
        "no-such-camera", f"Venue {venue.id} has the cameras {', '.join(ids)}.", camera=camera_id, expected=ids
    )


def no_such_job(keep_jobs_days: float) -> Problem:
    """Problem of a request about a job that is not stored."""
    kept = f"{keep_jobs_days:g} days"
    return Problem("job-not-found", f"GET /jobs lists those there are; they are deleted {kept} after their end.")


def venue_busy(job_id: str) -> Problem:
    """Problem of a request that an active job of the venue is in the way of."""
    return Problem(
        "venue-busy",
        f"Wait for job {job_id} of the same venue or cancel it.",
        headers={"Retry-After": str(RETRY_AFTER_S), "Location": f"/jobs/{job_id}"},
        job=job_id,
    )


def venue_is_stored(venue_id: str) -> Problem:
    """Problem of a request that brings a site for a venue that is stored already."""
    return Problem(
        "venue-stored",
        f"Venue {venue_id} says itself what it is: leave out the part site, and name in options.cameras those that are "
        "to be found again.",
    )


def venue_moved_on(venue_id: str | None, job_id: str, newest: Revision | None) -> Problem:
    """Problem of a decision about a job whose venue was changed since; `newest`: its revision, None if it is gone."""
    is_now = f"is at revision {newest.revision} ({newest.cause})" if newest else "is deleted"
    return Problem(
        "venue-moved-on",
        f"Venue {venue_id} {is_now} or has another field by now. To go back to earlier poses restore their revision: "
        f"GET /venues/{venue_id}/history lists them (esc venue history {venue_id}; esc venue restore {venue_id} N).",
        job=job_id,
        got=newest and newest.revision,
    )


def no_poses(job: Job) -> Problem:
    """Problem of a request for the poses of a job that has found none."""
    return Problem("poses-not-found", "It has not found any yet." if job.open else "It found none.", job=job.id)


def nothing_to_decide(job: Job) -> Problem:
    """Problem of a decision about the poses of a job that is no calibration, or has found none."""
    if job.kind != "find":
        return no_poses(job)
    detail = f"It stores nothing by itself: POST /venues/{job.venue}/adopt-found takes what it found."
    return Problem("poses-not-found", detail, job=job.id)


def no_refined_pose(camera: str, why: str) -> Problem:
    """Problem of a request for a refined pose that a camera does not have."""
    return Problem("refined-not-found", f"Camera {camera} has none: {why}", camera=camera)


def no_refined_since(venue_id: str) -> str:
    """Return why a camera of a stored venue has no refined pose, and what to do."""
    return (
        "no calibration that found one was accepted since its pose, its lens or the field were put, or the job was "
        f"deleted. POST /venues/{venue_id}/calibrate."
    )
