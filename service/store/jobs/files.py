"""Paths of the files of jobs in the blob store."""

from collections.abc import Sequence

# Pictures to be laid over others.
LAYERS = ("seam", "stored", "new", "mask")
# Pictures of a calibration that can be drawn when somebody looks, of all cameras and of each; those that share most of
# their work are drawn together. What the network saw cannot be drawn again without it.
STITCHED = ("preview", "preview_before", "seam")
BIRDSEYE = ("birdseye",)
OF_CAMERA = ("overlay", "frame", "stored", "new")
# A picture of a candidate of a camera that was looked for.
CANDIDATE = "candidate"


def frame_folder(job_id: str) -> str:
    """Return the folder of the frames of a job."""
    return f"frames/{job_id}"


def frame_path(job_id: str, part: str, number: int, sha256: str) -> str:
    """Return the path of a frame or photo, which ends with the hash of its bytes."""
    return f"{frame_folder(job_id)}/{part}/{number}.{sha256}"


def pictures_folder(job_id: str) -> str:
    """Return the folder of the pictures of all attempts of a job."""
    return f"pictures/{job_id}"


def picture_folder(job_id: str, run_token: str) -> str:
    """Return the folder of the pictures of an attempt: one given up late cannot overwrite those of the next."""
    return f"{pictures_folder(job_id)}/{run_token}"


def drawn_together(name: str) -> tuple[str, ...]:
    """A picture that can be drawn when somebody looks, and those that are drawn along with it; () for all others."""
    kind, _, camera = name.partition("_")
    if name in STITCHED:
        return STITCHED
    if kind in OF_CAMERA and camera:
        return tuple(f"{each}_{camera}" for each in OF_CAMERA)
    return BIRDSEYE if name in BIRDSEYE else ()


def names_of_all(cameras: Sequence[str]) -> list[str]:
    """The names of all pictures that can be drawn when somebody looks, of a calibration of these cameras."""
    return [*STITCHED, *BIRDSEYE, *(f"{kind}_{camera}" for camera in cameras for kind in OF_CAMERA)]


def source_file(folder: str, camera: str) -> str:
    """Return the path of the frame, beside the pictures, from which they are drawn after the frames have expired."""
    return f"{folder}/source/{camera}"


def picture_address(name: str) -> str:
    """A picture's name as its address has it: `overlay_left` is `overlay/left`, `candidate_left_1` `candidate/left/1`.

    Ids of cameras may have underscores, kinds of pictures and numbers of candidates have none.
    """
    kind, _, rest = name.partition("_")
    if kind == CANDIDATE:
        camera, _, number = rest.rpartition("_")
        rest = f"{camera}/{number}"
    return f"{kind}/{rest}" if rest else kind


def candidate_picture_name(camera: str, number: int) -> str:
    """The name of the picture of a candidate, which are counted from 1."""
    return f"{CANDIDATE}_{camera}_{number}"


def picture_file(name: str) -> str:
    """Return the file name of a picture: `overlay_left.jpg`, or `mask_left.png` of a transparent layer."""
    return f"{name}.{'png' if name.partition('_')[0] in LAYERS else 'jpg'}"
