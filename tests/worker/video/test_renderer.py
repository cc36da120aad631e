"""The fast renderer against the exact one."""

from dataclasses import replace

import av
import cv2
import numpy as np
import pytest

from testbed.synthetic import moved
from tests.worker.video.filming import PITCH, PLAYER, cameras, empty, frame_at
from worker.calibration.stitching.panorama import BACKDROP, Panorama, panorama
from worker.calibration.stitching.people_seam import seam_bands, shows_field
from worker.calibration.stitching.photometry import Light
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.video.moving_seams import MovingSeams
from worker.video.renderer import Renderer
from worker.video.yuv_planes import EXACT, Picture, picture_of, planes_of

pytestmark = pytest.mark.slow

LIGHTS = {
    "left": Light((1.15, 1.0, 0.9), 0.1, 0.2),
    "right": Light((0.9, 1.0, 1.12), -0.08, -0.15),
}


def filmed(frames):
    return {camera: picture_of(av.VideoFrame.from_ndarray(one, format="bgr24")) for camera, one in frames.items()}


def pictures():
    return filmed({one.id: frame_at(one, 1.0) for one in cameras})


def rendered_by(renderer, size, pictures):
    frame = av.VideoFrame(*size, "yuv420p")
    frame.colorspace, frame.color_range = 1, 1
    renderer.render(pictures, planes_of(frame))
    return Picture(frame).colours.astype(int)


def rendered(panorama, pictures):
    renderer = Renderer(panorama)
    colours = rendered_by(renderer, panorama.size, pictures)
    renderer.close()
    return colours


def colours(pictures):
    return {camera: picture.colours for camera, picture in pictures.items()}


@pytest.mark.parametrize("lights", [{}, LIGHTS], ids=["as they are", "evened"])
@pytest.mark.parametrize("projection", ["pannini", "birds-eye"])
@pytest.mark.parametrize("width", [160, 640])
def test_video_is_the_exact_picture(width, projection, lights):
    shown = panorama(PITCH, chosen_view(PITCH, cameras, ViewChoice(projection, width)), cameras, lights)
    seen = pictures()
    exact, fast = shown.picture(colours(seen)).astype(int), rendered(shown, seen)
    assert np.median(np.abs(fast - exact)) <= 1
    assert np.percentile(np.abs(fast - exact), 90) <= 6
    assert np.abs((fast - exact).mean(axis=(0, 1))).max() < 2


def test_a_grey_ramp_has_the_tones_of_its_light():
    # No colour and no detail: nothing but rounding is left.
    view = chosen_view(PITCH, cameras, ViewChoice(width=320))
    shown = panorama(PITCH, view, cameras, LIGHTS)
    for level in (20, 100, 180, 230):
        plain = filmed({one.id: np.full((216, 384, 3), level, np.uint8) for one in cameras})
        exact, fast = shown.picture(colours(plain)).astype(int), rendered(shown, plain)
        # Colour at the borders of what is seen is of two by two pixels.
        assert np.percentile(np.abs(fast - exact), 98) <= 3


def test_what_no_camera_sees_is_backdrop_in_every_picture():
    shown = panorama(PITCH, chosen_view(PITCH, cameras, ViewChoice(width=320, field_of_view_deg=200)), cameras)
    fast = rendered(shown, pictures())
    assert not shown.seen.all()
    # Colour reaches a few pixels over the border of what is seen.
    inner = cv2.erode((~shown.seen).astype(np.uint8), np.ones((7, 7))) > 0
    assert inner.any()
    assert np.abs(fast[inner] - BACKDROP).max() <= 2


def test_its_tables_follow_cameras_that_move():
    view = chosen_view(PITCH, cameras, ViewChoice(width=480))
    still = panorama(PITCH, view, cameras)
    turned = panorama(PITCH, view, [moved(one, rotation=(0.004, 0.003, 0)) for one in cameras])
    weights = {part.camera: part.weight for part in still.parts}
    moving = replace(still, parts=[replace(part, weight=weights[part.camera]) for part in turned.parts])
    renderer = Renderer(still)
    assert renderer.fits(moving)
    assert not renderer.fits(turned)
    renderer.move(moving)
    found = rendered_by(renderer, view.size, pictures())
    renderer.close()
    assert np.array_equal(found, rendered(moving, pictures()))


def test_odd_sizes_are_refused():
    view = chosen_view(PITCH, cameras, ViewChoice(width=321, height=100))
    with pytest.raises(ValueError, match="even numbers"):
        Renderer(panorama(PITCH, view, cameras))


@pytest.mark.parametrize(
    ("form", "matrix", "full"),
    [("yuvj420p", 5, True), ("yuv422p10le", 1, False), ("yuv420p", 5, False), ("nv12", 1, False)],
)
def test_every_format_becomes_the_same_colours(form, matrix, full):
    bars = np.repeat(np.array([[40, 60, 200], [200, 90, 30], [90, 180, 60], [128, 128, 128]], np.uint8), 16, axis=0)
    picture = np.repeat(bars[None], 32, axis=0)
    frame = av.VideoFrame.from_ndarray(picture, format="bgr24").reformat(
        format=form,
        dst_colorspace=matrix,
        src_color_range=2,
        dst_color_range=2 if full else 1,
        interpolation=EXACT,
    )
    frame.colorspace, frame.color_range = matrix, 2 if full else 1
    seen = picture_of(frame).colours.astype(int)
    assert np.abs(seen[:, 6::16] - picture[:, 6::16].astype(int)).max() <= 4


def people_seams():
    view = chosen_view(PITCH, cameras, ViewChoice(width=960))
    shown = panorama(PITCH, view, cameras)
    return shown, Renderer(shown, seams=MovingSeams(shown, seam_bands(shown, shows_field(PITCH, view), 25)))


def with_player(of, x, y):
    """The pitch with somebody in blue."""
    picture = empty(of.id).copy()
    corners = of.project(np.array([x, y, 0.0]) + PLAYER)
    cv2.fillConvexPoly(picture, cv2.convexHull(np.rint(16 * corners).astype(np.int32)), (250, 60, 20), cv2.LINE_AA, 4)
    return picture


def test_seams_that_move_stay_where_nobody_is():
    shown, moving = people_seams()
    frames = filmed({one.id: empty(one.id) for one in cameras})
    difference = np.abs(rendered_by(moving, shown.size, frames) - rendered_by(Renderer(shown), shown.size, frames))
    # Frames are halved as the median of a stretch asks for, and stretches differ.
    assert np.percentile(difference, 98) <= 1
    assert difference.max() <= 10


@pytest.mark.parametrize("x", [-0.4, 0.0, 0.4])
def test_somebody_on_the_seam_is_of_one_camera(x):
    shown, moving = people_seams()
    rendered_by(moving, shown.size, filmed({one.id: empty(one.id) for one in cameras}))
    frames = filmed({one.id: with_player(one, x, -26.0) for one in cameras})
    found, still = rendered_by(moving, shown.size, frames), rendered_by(Renderer(shown), shown.size, frames)
    alone = [
        rendered_by(
            Renderer(Panorama(shown.size, [replace(part, weight=np.ones_like(part.weight))])), shown.size, frames
        )
        for part in shown.parts
    ]
    player = np.any([picture[..., 0] > 200 for picture in alone], axis=0)
    player &= np.any([picture[..., 2] < 100 for picture in alone], axis=0)
    moved, stayed = (min(np.abs(one - other)[player].mean() for other in alone) for one in (found, still))
    assert moved < stayed / 5
