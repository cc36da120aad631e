"""Introduction of the OpenAPI document: frames of reference, order of steps, and groups of routes."""

DESCRIPTION = """\
Frames of fixed cameras around a sports field go in, their poses come out.

**World:** right-handed, in metres. The origin is the centre of the field on the ground. x runs along `length_m`, to the
right as seen from the cameras' usual side, where y < 0. y runs across the field away from that side, z up.

**Cameras** are OpenCV's: x right, y down, z forward, pixel centres at integers. `rotation` is a Rodrigues vector (rad)
from world to camera, `position` the camera's centre in the world, `translation` = -R·position is OpenCV's `tvec`.

**Order of steps:** (before cameras are mounted, `POST /plan` says how exactly they will be calibrated)

1. `POST /venues/{venue_id}/find`: a frame per camera and the name of the sport. The job finds lenses and first poses;
   `POST /venues/{venue_id}/adopt-found` makes them a venue, `POST /jobs/{job_id}/calibrate` calibrates that at once.
2. Or by hand: `POST /intrinsics` finds the lens of each camera from photos of a board, `PUT /venues/{venue_id}` has the
   field and the cameras with first poses, and `POST /venues/{venue_id}/cameras/{camera}/locate` finds one from clicks.
3. `POST /venues/{venue_id}/calibrate`: a frame per camera. The answer is a job; `GET /jobs/{job_id}?wait=60` waits
   for its end. Poses that pass the quality gate become those of the venue.
4. `GET /venues/{venue_id}/poses?format=...`: the poses that hold, for other tools.

Errors are problem details (RFC 9457); `GET /problems/{kind}` explains their `type`, `GET /refusals/{reason}` why a pose
was refused.
"""

TAGS = [
    {
        "name": "venues",
        "description": "A venue is a field and the cameras around it, with the poses that hold, their history, alarms "
        "and stitched view.",
    },
    {
        "name": "jobs",
        "description": "What is computed: calibrations, fits of the field, lenses, first poses and searches for "
        "cameras, with their progress, results and pictures.",
    },
    {"name": "keys", "description": "API keys: who may call, and what."},
    {
        "name": "health",
        "description": "Whether the service is alive and ready, its figures, and what its problems mean.",
    },
]
