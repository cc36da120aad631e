"""mrcal's .cameramodel: a Python literal, one camera a file.

Lenses: LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5, 8 and 12, with OpenCV's coefficients; CAHVOR, stereographic and
splined models have no counterpart. `extrinsics`, also called `rt_cam_ref`, take the reference to the camera: a
Rodrigues vector and a translation in metres. Pixel centres are at integers.
"""

from service.formats.lens import COEFFICIENTS, NumberedCamera
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, camera_matrix, lens_of, stem_of
from service.formats.rotations import pose_from_translation

LENGTHS = {"LENSMODEL_PINHOLE": 0, **{f"LENSMODEL_OPENCV{length}": length for length in (4, 5, 8, 12)}}


def write(camera: NumberedCamera) -> bytes:
    """Return the model of a camera, with as few coefficients as its lens needs."""
    camera.require_support("mrcal", COEFFICIENTS[: max(LENGTHS.values())])
    used = max((n for n, value in enumerate(camera.coefficients.values(), start=1) if value), default=0)
    model, length = next(one for one in LENGTHS.items() if one[1] >= used)
    members = {
        "lensmodel": model,
        "intrinsics": [*camera.focal, *camera.principal, *[*camera.coefficients.values()][:length]],
        "extrinsics": [*camera.pose.rotation, *camera.pose.translation],
        "imagersize": [*camera.size],
    }
    lines = [f"    {name!r}: {value!r}," for name, value in members.items()]
    return "\n".join(["{", *lines, "}", ""]).encode()


def recognises(file: ParsedFile) -> bool:
    """True for a literal with a lens model."""
    return file.kind == "python" and "lensmodel" in file.top


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the camera of a file, named as the file."""
    top, model = file.top, file.top["lensmodel"]
    if model.value not in LENGTHS:
        model.refuse(f"one of {', '.join(LENGTHS)}: `mrcal-convert-lensmodel` fits one")
    fx, fy, cx, cy, *coefficients = top["intrinsics"].numbers(4 + LENGTHS[model.value])
    extrinsics = top["rt_cam_ref"] if "rt_cam_ref" in top else top["extrinsics"]
    numbers = extrinsics.numbers(6)
    pose = pose_from_translation(numbers[:3], numbers[3:])
    lens = lens_of(top["intrinsics"], camera_matrix(fx, fy, cx, cy), coefficients)
    return [CameraRecord(stem_of(file.name), lens, top["imagersize"].size(), pose)]
