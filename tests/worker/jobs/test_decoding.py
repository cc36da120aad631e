"""Files of frames as pixels: what is damaged is refused, and what cameras and encoders write that is whole is not."""

import struct
import zlib
from contextlib import suppress

import cv2
import numpy as np
import pytest

from testbed.parameters import try_first
from tests.worker.jobs.damage import DAMAGES, damage, is_visible, scan_of, whole_files, without_tables
from worker.jobs.decoding import decode_frame, decode_image
from worker.jobs.from_schemas import JobFailedError
from worker.jobs.jpeg import DamagedPictureError

pytestmark = pytest.mark.slow

SCENE = cv2.imread("demo/left.jpg", cv2.IMREAD_REDUCED_COLOR_4)


JPEG = cv2.imencode(".jpg", SCENE)[1].tobytes()


def as_opencv_reads(file, flags=cv2.IMREAD_COLOR_BGR):
    return cv2.imdecode(np.frombuffer(file, np.uint8), flags | cv2.IMREAD_IGNORE_ORIENTATION)


@pytest.mark.parametrize("cropped", try_first([[7, 9], [0, 0]]))
def test_whole_pictures_of_all_encoders_are_read_to_the_pixels_that_opencv_reads(cropped):
    scene = SCENE[: SCENE.shape[0] - cropped[0], : SCENE.shape[1] - cropped[1]]
    for name, file in whole_files(scene, (60, 95)):
        assert np.array_equal(decode_image(name, file), as_opencv_reads(file)), name
        grey = as_opencv_reads(file, cv2.IMREAD_GRAYSCALE)
        assert np.array_equal(decode_image(name, file, grey=True), grey), name


def unseen_damages(whole, kind, count):
    """How many of so many damages change the picture and are decoded as if it were whole."""
    picture = as_opencv_reads(whole)
    unseen = 0
    for seed in range(count):
        with suppress(DamagedPictureError):
            unseen += is_visible(decode_image("left", damage(whole, kind, np.random.default_rng(seed))), picture)
    return unseen


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_jpeg_that_is_damaged_in_its_scan_is_not_decoded(kind):
    whole = cv2.imencode(".jpg", SCENE, [cv2.IMWRITE_JPEG_QUALITY, 90])[1].tobytes()
    assert unseen_damages(whole, kind, 10) == 0


@pytest.mark.long
@pytest.mark.parametrize("quality", [80, 95])
@pytest.mark.parametrize("kind", DAMAGES)
def test_none_of_two_hundred_damages_of_a_frame_of_4k_is_decoded(kind, quality):
    frame = cv2.imread("demo/left.jpg")
    whole = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
    assert unseen_damages(whole, kind, 25) == 0


@pytest.mark.long
def test_a_thousand_whole_pictures_are_decoded():
    scenes = [cv2.imread(f"demo/{camera}.jpg", cv2.IMREAD_REDUCED_COLOR_4) for camera in ("left", "right")]
    count = 0
    for scene in scenes:
        for cut in range(0, 48, 8):
            for name, file in whole_files(scene[cut // 2 :, cut:]):
                decode_image(name, file)
                count += 1
    assert count > 1000


def test_a_frame_that_is_damaged_fails_by_the_name_of_its_camera():
    damaged = damage(JPEG, "flipped", np.random.default_rng(1))
    with pytest.raises(JobFailedError, match="camera left is of no use: it is damaged") as failure:
        decode_frame("left", SCENE.shape[1::-1], damaged)
    assert (failure.value.error.type, failure.value.error.camera) == ("/problems/broken-image", "left")


def test_blocks_that_are_too_bright_from_one_on_are_a_damage():
    """As one lost difference leaves them where the count of blocks is right: libjpeg has no warning for that."""
    shifted = SCENE.astype(int)
    shifted[16 * 9 : 16 * 10, 16 * 20 :] += 40
    shifted[16 * 10 :] += 40
    file = cv2.imencode(".jpg", shifted.clip(0, 255).astype(np.uint8))[1].tobytes()
    with pytest.raises(DamagedPictureError, match="damaged from row 144 on"):
        decode_image("camera left", file)


def test_a_bar_straight_across_the_picture_is_none():
    barred = SCENE.copy()
    barred[:32], barred[-64:] = 0, 255
    decode_image("camera left", cv2.imencode(".jpg", barred)[1].tobytes())


@pytest.mark.parametrize("before", [b"\r\n", b"\xff\xd8"])
def test_what_cameras_send_around_a_jpeg_does_not_matter(before):
    padded = before + JPEG[:-2] + bytes(40) + JPEG[-2:] + b"\r\n--boundary"
    assert np.array_equal(decode_image("camera left", padded), as_opencv_reads(JPEG))


def test_zeros_in_place_of_the_last_of_a_scan_are_no_padding():
    with pytest.raises(DamagedPictureError, match="premature end"):
        decode_image("camera left", JPEG[:-4096] + bytes(4094) + JPEG[-2:])


@pytest.mark.parametrize("tables", ["written", "of the standard"])
def test_zeros_in_place_of_data_are_no_picture_though_each_is_a_code(tables):
    whole = without_tables(JPEG) if tables == "of the standard" else JPEG
    middle = sum(scan_of(whole)) // 2
    with pytest.raises(DamagedPictureError, match="zeros in place of its data"):
        decode_image("camera left", whole[:middle] + bytes(300) + whole[middle + 300 :])


def test_zeros_that_mean_a_flat_picture_are_one():
    """Tables that fit the picture give its commonest block the code of zeros alone."""
    flat = np.zeros((2160, 3840, 3), np.uint8)
    file = cv2.imencode(".jpg", flat, [cv2.IMWRITE_JPEG_OPTIMIZE, 1])[1].tobytes()
    assert bytes(1000) in file
    assert np.array_equal(decode_image("camera left", file), flat)


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_png_that_is_damaged_fails(kind):
    whole = cv2.imencode(".png", SCENE)[1].tobytes()
    damaged = damage(whole, kind, np.random.default_rng(1), (100, len(whole) - 100))
    with pytest.raises(JobFailedError, match="camera left is of no use: it cannot be decoded"):
        decode_frame("left", SCENE.shape[1::-1], damaged)


@pytest.mark.parametrize(("width", "height"), [(480, 270), (1920, 1080), (800, 450)])
def test_a_frame_of_the_same_shape_is_resized_and_that_is_told(width, height):
    size, remarks = SCENE.shape[1::-1], []
    other = cv2.resize(SCENE, (width, height), interpolation=cv2.INTER_AREA)
    frame = decode_frame("left", size, cv2.imencode(".png", other)[1].tobytes(), remarks.append)
    assert frame.shape == SCENE.shape
    assert np.abs(frame.astype(int) - SCENE).mean() < 8
    assert f"camera left sent {width}x{height} pixels, and its lens is for {size[0]}x{size[1]}" in remarks[0]


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_the_values_of_a_sensor_are_read_in_their_range(bits):
    values = SCENE.astype(np.uint16) << (bits - 8)
    values[0, 0] = (1 << bits) - 1
    remarks = []
    picture = decode_image("camera left", cv2.imencode(".png", values)[1].tobytes(), remark=remarks.append)
    assert np.array_equal(picture[1:], SCENE[1:])
    assert len(remarks) == (bits < 16)
    assert (
        bits == 16 or f"is {(1 << bits) - 1} of 65535, so its file of 16 bits was read as one of {bits}" in remarks[0]
    )


def test_the_picture_of_a_png_is_read_and_not_its_animation():
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    whole = cv2.imencode(".png", SCENE)[1].tobytes()
    height, width = SCENE.shape[:2]
    control = struct.pack(">IIIIIHHBB", 0, width, height, 0, 0, 1, 10, 0, 0)
    black = struct.pack(">I", 1) + zlib.compress(bytes(height * (1 + 3 * width)))
    animated = whole[:33] + chunk(b"acTL", struct.pack(">II", 1, 0)) + whole[33:-12]
    animated += chunk(b"fcTL", control) + chunk(b"fdAT", black) + whole[-12:]
    assert np.array_equal(decode_image("camera left", animated), SCENE)


def test_scans_are_damaged_where_they_are():
    first, last = scan_of(JPEG)
    assert 300 < first < 1000
    assert last == len(JPEG) - 2
