"""Where the files of jobs lie in the blob store, and what they are called."""

from __future__ import annotations

from collections.abc import Sequence

# Pictures to be laid over others.
LAYERS = ("seam", "stored", "new", "mask")
# Pictures of a calibration that can be drawn when somebody looks, of all cameras and of each; those that share most of
# their work are drawn together. What the network saw cannot be drawn again without it.
STITCHED = ("preview", "preview_before", "seam")
BIRDSEYE = ("birdseye",)
OF_CAMERA = ("overlay", "frame", "stored", "new")
# Of a camera that was looked for.
CANDIDATE = "candidate"


def frame_folder(job_id: str) -> str:
    """Where the frames of a job lie."""
    return f"frames/{job_id}"


def frame_path(job_id: str, part: str, number: int, sha256: str) -> str:
    """Where a frame of a camera lies, or a photo; the hash of its bytes is in its name, by which it is known again."""
    return f"{frame_folder(job_id)}/{part}/{number}.{sha256}"


def pictures_folder(job_id: str) -> str:
    """Where the pictures of all attempts of a job lie."""
    return f"pictures/{job_id}"


def picture_folder(job_id: str, run_token: str) -> str:
    """Each attempt has pictures of its own, so that one given up late cannot overwrite those of the next."""
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
    """What pictures can be drawn of after the frames have gone from their own folder, in the folder of the pictures."""
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
    """What the file of a picture is called: `overlay_left.jpg`; layers, which can be seen through, `mask_left.png`."""
    return f"{name}.{'png' if name.partition('_')[0] in LAYERS else 'jpg'}"
