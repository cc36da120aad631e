"""COLMAP's model: cameras.txt, images.txt and points3D.txt in a zip, read also as cameras.bin and images.bin.

Pixel centres are at 0.5 there and at integers here. Poses take the world to OpenCV's camera; unit and axes of the world
are whatever the model was aligned to. Written are OPENCV where it is exact, else FULL_OPENCV, and OPENCV_FISHEYE; all
models are read but fisheyes with a thin prism and EQUIRECTANGULAR. DIVISION, FOV and EUCM become the nearest fisheye.
"""

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple

from service.formats.archive import archive
from service.formats.lens import RADIAL, TANGENTIAL, NumberedCamera
from service.formats.nodes import FileRefusedError, Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, camera_matrix, lens_of, stem_of
from service.formats.rotations import pose_from_translation, quaternion, vector_of_quaternion
from service.schemas.geometry import Intrinsics

# Numbers and parameters of the models, in COLMAP's order (src/colmap/sensor/models.h). The names of FISHEYE models are
# those of `cv2.fisheye`; None: a lens that OpenCV does not have.
MODELS: dict[str, tuple[int, tuple[str, ...] | None]] = {
    "SIMPLE_PINHOLE": (0, ("f", "cx", "cy")),
    "PINHOLE": (1, ("fx", "fy", "cx", "cy")),
    "SIMPLE_RADIAL": (2, ("f", "cx", "cy", "k1")),
    "RADIAL": (3, ("f", "cx", "cy", "k1", "k2")),
    "OPENCV": (4, ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")),
    "OPENCV_FISHEYE": (5, ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")),
    "FULL_OPENCV": (6, ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")),
    "FOV": (7, ("fx", "fy", "cx", "cy", "omega")),
    "SIMPLE_RADIAL_FISHEYE": (8, ("f", "cx", "cy", "k1")),
    "RADIAL_FISHEYE": (9, ("f", "cx", "cy", "k1", "k2")),
    "THIN_PRISM_FISHEYE": (10, None),
    "RAD_TAN_THIN_PRISM_FISHEYE": (11, None),
    "SIMPLE_DIVISION": (12, ("f", "cx", "cy", "k")),
    "DIVISION": (13, ("fx", "fy", "cx", "cy", "k")),
    "SIMPLE_FISHEYE": (14, ("f", "cx", "cy")),
    "FISHEYE": (15, ("fx", "fy", "cx", "cy")),
    "EUCM": (16, ("fx", "fy", "cx", "cy", "alpha", "beta")),
    "EQUIRECTANGULAR": (17, None),
}
COEFFICIENT_ORDER = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
POINT2D_BYTES = 24
SizedLens = tuple[Intrinsics, tuple[int, int]]


class Image(NamedTuple):
    """An image of a model, by the number of its camera; `numbers`: quaternion and translation, world to camera."""

    node: Node
    numbers: list[float]
    camera: int
    name: str


def write(cameras: Sequence[NumberedCamera]) -> bytes:
    """Return a zip of the three files. Images are named as their cameras, with `.jpg`: the frames to put beside them.

    Ids follow the names, as those of `feature_extractor` do: `point_triangulator` takes no model whose ids differ from
    those of its database.
    """
    numbered = list(enumerate(sorted(cameras, key=_name), start=1))
    lenses = ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]", *(_camera(number, camera) for number, camera in numbered)]
    images = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; then a line of POINTS2D[]"]
    for number, camera in numbered:
        images += [_image(number, camera), ""]
    points = ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]"]
    files = {"cameras.txt": lenses, "images.txt": images, "points3D.txt": points}
    return archive({name: "\n".join([*lines, ""]).encode() for name, lines in files.items()})


def _name(camera: NumberedCamera) -> str:
    """Return the name of the file of a camera's frame."""
    return f"{camera.id}.jpg"


def _camera(number: int, camera: NumberedCamera) -> str:
    if camera.is_fisheye:
        model, coefficients = "OPENCV_FISHEYE", camera.distortion
    else:
        camera.require_support("colmap", {*RADIAL, *TANGENTIAL})
        needs_all = any(camera.coefficients[name] for name in ("k3", "k4", "k5", "k6"))
        model = "FULL_OPENCV" if needs_all else "OPENCV"
        coefficients = [camera.coefficients[name] for name in COEFFICIENT_ORDER[: 8 if needs_all else 4]]
    centre = [value + 0.5 for value in camera.principal]
    return _line(number, model, *camera.size, *map(float, [*camera.focal, *centre, *coefficients]))


def _image(number: int, camera: NumberedCamera) -> str:
    pose = camera.pose
    return _line(number, *quaternion(pose.rotation), *pose.translation, number, _name(camera))


def _line(*words: str | float) -> str:
    return " ".join(word if isinstance(word, str) else repr(word) for word in words)


def recognises(file: ParsedFile) -> bool:
    """True for lines of cameras or images, and for bytes that are cameras or images to their end, or are named so."""
    if file.kind == "binary":
        named = PurePath(file.name).name in ("cameras.bin", "images.bin")
        return named or any(_ends_well(parse, file) for parse in (_binary_cameras, _binary_images))
    return file.kind == "colmap"


def read(files: Sequence[ParsedFile]) -> list[CameraRecord]:
    """Return a camera for each image, or for each of the cameras where the files have no images."""
    lenses: dict[int, SizedLens] = {}
    images: list[Image] = []
    for file in files:
        if file.kind == "binary":
            is_cameras = PurePath(file.name).name == "cameras.bin" or _ends_well(_binary_cameras, file)
            lenses |= dict(_binary_cameras(file)) if is_cameras else {}
            images += [] if is_cameras else _binary_images(file)
        elif _is_cameras(file):
            lenses |= dict(_text_cameras(file))
        else:
            images += _text_images(file)
    if not images:
        return [CameraRecord(f"camera-{number}", *lens) for number, lens in lenses.items()]
    return [_posed(image, lenses) for image in images]


def _posed(image: Image, lenses: Mapping[int, SizedLens]) -> CameraRecord:
    if image.camera not in lenses:
        image.node.refuse("a camera of cameras.txt or cameras.bin", f"camera {image.camera}")
    if not any(image.numbers[:4]):
        image.node.refuse("a quaternion that is not 0")
    pose = pose_from_translation(vector_of_quaternion(image.numbers[:4]), image.numbers[4:7])
    return CameraRecord(stem_of(image.name), *lenses[image.camera], pose)


def _lens(node: Node, model: str, parameters: Sequence[float], size: tuple[int, int]) -> Intrinsics:
    names = MODELS[model][1] if model in MODELS else None
    if names is None:
        known = ", ".join(name for name, (_, parts) in MODELS.items() if parts)
        node.refuse(f"a model that OpenCV has too ({known})", model)
    if len(parameters) != len(names):
        node.refuse(f"{len(names)} parameters of {model} ({', '.join(names)})", f"{len(parameters)}")
    k = dict(zip(names, parameters, strict=True))
    fx, fy = k.get("fx", k.get("f", 0.0)), k.get("fy", k.get("f", 0.0))
    principal = k["cx"] - 0.5, k["cy"] - 0.5
    if model.endswith(("DIVISION", "FOV", "EUCM")):
        return _fitted_lens(node, k, (fx, fy), principal, size)
    matrix = camera_matrix(fx, fy, *principal)
    is_fisheye = model.endswith("FISHEYE")
    order = ("k1", "k2", "k3", "k4") if is_fisheye else COEFFICIENT_ORDER
    last = max((n for n, name in enumerate(order, start=1) if name in k), default=0)
    coefficients = [k.get(name, 0.0) for name in order[:last]]
    return lens_of(node, matrix, coefficients, "fisheye" if is_fisheye else "opencv")


def _fitted_lens(
    node: Node, k: dict[str, float], focal: tuple[float, float], principal: tuple[float, float], size: tuple[int, int]
) -> Intrinsics:
    # NumPy takes its time to load.
    from service.formats.fitted_fisheye import division, enhanced_unified, field_of_view, fit_fisheye

    if min(focal) <= 0:
        node.refuse("focal lengths above 0 pixels")
    if "k" in k:
        angle_of = division(k["k"])
    else:
        angle_of = field_of_view(k["omega"]) if "omega" in k else enhanced_unified(k["alpha"], k["beta"])
    return fit_fisheye(node, angle_of, focal, principal, size)


def _is_cameras(file: ParsedFile) -> bool:
    words = next(iter(_lines(file)))[1].split()
    return len(words) > 3 and words[1].replace("_", "").isalpha() and words[2].isdigit()


def _lines(file: ParsedFile) -> Iterator[tuple[Node, str]]:
    """Yield the lines that are no comments; empty ones too, for images without points have one."""
    for number, line in enumerate(file.content.splitlines(), start=1):
        if not line.startswith("#"):
            yield Node(file.name, f"line {number}", line), line


def _text_cameras(file: ParsedFile) -> Iterator[tuple[int, SizedLens]]:
    for node, line in _lines(file):
        if not line.strip():
            continue
        words = line.split()
        if len(words) < 5:
            node.refuse("CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]")
        number, _, width, height, *parameters = (_number(node, word) for word in [words[0], "0", *words[2:]])
        size = int(width), int(height)
        yield int(number), (_lens(node, words[1], parameters, size), size)


def _text_images(file: ParsedFile) -> Iterator[Image]:
    lines = _lines(file)
    for node, line in lines:
        if not line.strip():
            continue
        words = line.split(maxsplit=9)
        if len(words) < 10:
            node.refuse("IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME")
        numbers = [_number(node, word) for word in words[1:9]]
        yield Image(node, numbers[:7], int(numbers[7]), words[9])
        # Its points.
        next(lines, None)


def _number(node: Node, word: str) -> float:
    try:
        return Node(node.file, node.place, float(word)).number()
    except ValueError:
        node.refuse("finite numbers", word)


def _ends_well(parse: Callable[[ParsedFile], Iterator[object]], file: ParsedFile) -> bool:
    """True if bytes are what a parser reads, up to their end."""
    try:
        return bool(list(parse(file)))
    except FileRefusedError:
        return False


def _unpack(file: ParsedFile, form: str, at: int) -> tuple[Any, ...]:
    """Return the values at a byte; refuse a file that ends before."""
    try:
        return struct.unpack_from(form, file.content, at)
    except (struct.error, OverflowError):
        raise FileRefusedError(
            file.name, f"byte {at}", "more bytes: the file is cut off or damaged", f"{len(file.content)} in all"
        ) from None


def _binary_cameras(file: ParsedFile) -> Iterator[tuple[int, SizedLens]]:
    """Yield the cameras of cameras.bin: id, number of the model, width, height, parameters; little-endian."""
    by_number = {number: (name, parts) for name, (number, parts) in MODELS.items()}
    (count,) = _unpack(file, "<Q", 0)
    at = 8
    for _ in range(count):
        node = Node(file.name, f"byte {at}", None)
        camera, model, width, height = _unpack(file, "<iiQQ", at)
        name, parts = by_number.get(model, (f"number {model}", None))
        length = len(parts or ())
        parameters = _unpack(file, f"<{length}d", at + 24)
        yield camera, (_lens(node, name, parameters, (width, height)), (width, height))
        at += 24 + 8 * length
    _require_end(file, at)


def _binary_images(file: ParsedFile) -> Iterator[Image]:
    """Yield the images of images.bin: id, quaternion, translation, camera, name that ends with 0, points."""
    (count,) = _unpack(file, "<Q", 0)
    at = 8
    for _ in range(count):
        node = Node(file.name, f"byte {at}", None)
        _, *numbers, camera = _unpack(file, "<i7di", at)
        at += 64
        end = file.content.find(b"\0", at)
        if end < 0:
            node.refuse("a name that ends")
        name = file.content[at:end].decode(errors="replace")
        (points,) = _unpack(file, "<Q", end + 1)
        yield Image(node, numbers, camera, name)
        at = end + 9 + POINT2D_BYTES * points
    _require_end(file, at)


def _require_end(file: ParsedFile, at: int) -> None:
    if at != len(file.content):
        raise FileRefusedError(file.name, f"byte {at}", "the end of the file", f"{len(file.content) - at} bytes")
