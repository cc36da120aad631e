"""Where the files of jobs lie in the blob store, and what they are called."""

from __future__ import annotations

# Pictures to be laid over others.
LAYERS = ("seam", "stored", "new", "mask")


def frame_folder(job_id: str) -> str:
    """Where the frames of a job lie."""
    return f"frames/{job_id}"


def pictures_folder(job_id: str) -> str:
    """Where the pictures of all attempts of a job lie."""
    return f"pictures/{job_id}"


def picture_folder(job_id: str, run_token: str) -> str:
    """Each attempt has pictures of its own, so that one given up late cannot overwrite those of the next."""
    return f"{pictures_folder(job_id)}/{run_token}"


def picture_file(name: str) -> str:
    """What the file of a picture is called: `overlay_left.jpg`; layers, which can be seen through, `mask_left.png`."""
    return f"{name}.{'png' if name.partition('_')[0] in LAYERS else 'jpg'}"
