"""A lens is judged by what it does over its picture, whatever the size of its numbers."""

import re
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from service.intake.pose_warnings import warnings_of
from service.schemas.find import SoughtSite
from service.schemas.geometry import DISTORTION_LENGTHS, Intrinsics
from service.schemas.lens_map import lens_doubts, lens_warnings, map_of
from service.schemas.names import LensModel
from service.schemas.options import FindOptions
from service.schemas.venue import VENUE_EXAMPLE, CameraIn, VenueIn
from worker.jobs.from_schemas import lens_of

HD = (1920, 1080)
BASLER = [-13.238113, -98.012135, 0.001444, 0.002849, 1357.782415, -13.050801, -102.363353, 1383.055291]
FOLDING = [
    2.9972164631,
    -6.0928826332,
    0.00057462,
    -4.857e-05,
    -1.2618762255,
    3.5340938568,
    -4.2707939148,
    -5.302351952,
]
TILTED = [-0.2, 0.05, 1e-3, 1e-3, 0, 0, 0, 0, 0.01, 0.01, -0.01, 0, 0.2, -0.3]


POSE = VENUE_EXAMPLE["cameras"][0]["pose"]


def matrix(focal, cx, cy, focal_y=None):
    return [[focal, 0, cx], [0, focal_y or focal, cy], [0, 0, 1]]


def camera(matrix, distortion, size, model="opencv", sigma=True):
    lens = {"model": model, "matrix": matrix, "distortion": distortion, "sigma": {"fx": 4.0} if sigma else None}
    return CameraIn.model_validate({"id": "a", "image_size": list(size), "intrinsics": lens, "pose": POSE})


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        (camera(matrix(1500, 959.5, 539.5), [-0.1, 0.02, 0, 0, 0], HD), []),
        (camera(matrix(800, 959.5, 539.5), [-0.02, 0, 0, 0], HD, "fisheye"), []),
        (camera(matrix(1500, 959.5, 539.5), TILTED, HD), []),
        (camera(matrix(611, 959.5, 20.5, 650), [], HD, "cylindrical"), []),
        (camera(matrix(611, 959.5, 20.5), [], HD, "cylindrical", sigma=None), ["known to 3 % of the focal"]),
        (camera(matrix(250, 959.5, 539.5), [], HD, "equirectangular"), [r"no ray for 42 % of the picture"]),
        (camera(matrix(20000, 959.5, 539.5), [0.2, -7, 0, 0, -1450], HD), []),
        # Anamorphic within what a fit leaves, and a lens that was shifted.
        (camera(matrix(1500, 959.5, 539.5, 1525), [], HD), []),
        (camera(matrix(1500, 959.5, 700), [], HD), []),
        (camera(matrix(1874.63, 647.5, 485.5, 1879.56), BASLER, (1296, 972)), [r"k6\) falls to 0\.00025 over"]),
        (
            camera(matrix(2421.79, 1919.61, 1090.35), FOLDING, (3840, 2160)),
            [r"no ray for 32 % of the picture \(outside a radius of 145\d px\); lines there are not used"],
        ),
        (
            camera(matrix(1200, 959.5, 539.5), [-0.4, 0, 0, 0], HD, "fisheye"),
            [r"no ray for 32 % of the picture \(outside a radius of 73\d px\)"],
        ),
        (
            camera(matrix(299.54, 254.14, 183.94, 300.14), [], (2064, 1544)),
            [r"a quarter as large: .* at 516x386\? .* \[\[1198\.16, 0, 1018\.06\], \[0, 1200\.56, 737"],
        ),
        (camera(matrix(1400, 959.5, 539.5), [], (3840, 2160)), [r"half as large: .* at 1920x1080\?"]),
        (camera(matrix(930, 639.5, 359.5), [], HD), [r"two thirds as large: .* at 1280x720\?"]),
        (camera(matrix(2800, 1919.5, 1079.5), [], HD), [r"twice as large: .* \[\[1400, 0, 959\.5\]"]),
        (camera(matrix(1503.83, 828.86, 491.7, 1366.89), [-0.188, 0.506, -0.002, -0.073, -0.292], HD), ["10 % apart"]),
        # The order of another program: k1 k2 k3 p1 p2.
        (camera(matrix(1500, 959.5, 539.5), [0.1, -0.2, 2.0, 0, 0], HD), ["no ray", "times as far out"]),
    ],
)
def test_what_a_lens_does_over_its_picture_is_said_in_words(camera, words):
    said = lens_warnings(camera)
    assert len(said) == len(words), said
    assert all(line.startswith("camera a: ") for line in said)
    for line, pattern in zip(said, words, strict=True):
        assert re.search(pattern, line), line


@pytest.mark.parametrize(
    "distortion", [[-1e9, 0, 0, 0], [0, -1e9, 0, 0], [-200, 0, 0, 0, 0, 200, 0, 0], [*[0] * 12, 1.7, 0]]
)
def test_a_lens_without_rays_for_its_picture_is_refused(distortion):
    with pytest.raises(ValidationError, match=r"has rays for \d % of the 1920x1080 pixels: check the order"):
        camera(matrix(1500, 959.5, 539.5), distortion, HD)


@pytest.mark.parametrize(
    ("model", "distortion"),
    [("opencv", FOLDING), ("opencv", [-0.5, 0.1, 0, 0]), ("opencv", TILTED), ("fisheye", [0.1, -0.2, 0.1, -0.05])],
)
@pytest.mark.parametrize("focal", [800, 1500, 60000])
def test_the_part_without_rays_is_the_part_where_the_engine_has_none(model, distortion, focal):
    size = (1920, 1080)
    lens = SimpleNamespace(
        model=model, matrix=matrix(focal, 940, 560), distortion=distortion, sigma=None, sigma_from=None
    )
    columns, rows = ((np.arange(64) + 0.5) / 64 * side - 0.5 for side in size)
    rays = lens_of(lens, list(size)).undistort(np.stack(np.meshgrid(columns, rows), axis=-1))
    seen = map_of(model, lens.matrix, distortion, size)
    assert seen.blind_share == pytest.approx(np.isnan(rays[..., 0]).mean(), abs=0.02)


NUMBERS = st.one_of(st.floats(-1e308, 1e308), st.floats(-1e15, 1e15), st.floats(-2, 2), st.just(0.0))


@st.composite
def lenses(draw):
    model = draw(st.sampled_from(get_args(LensModel)))
    length = draw(st.sampled_from(DISTORTION_LENGTHS[model]))
    focal, skew = draw(st.floats(192, 3e5)), draw(st.one_of(st.just(0.0), NUMBERS))
    return {
        "model": model,
        "matrix": [[focal, skew, draw(st.floats(-1920, 3840))], [0, focal, draw(st.floats(-1080, 2160))], [0, 0, 1]],
        "distortion": draw(st.lists(NUMBERS, min_size=length, max_size=length)),
    }


@given(lens=lenses())
@settings(max_examples=60, deadline=None)
def test_numbers_of_any_size_are_refused_or_taken_with_a_lens_that_can_be_computed_with(lens):
    try:
        taken = CameraIn.model_validate({"id": "a", "image_size": list(HD), "intrinsics": lens, "pose": POSE})
    except ValidationError:
        return
    venue = VenueIn.model_validate(VENUE_EXAMPLE | {"cameras": [taken.model_dump()]}).to_venue()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        said = warnings_of([taken.pose], venue) + venue.lens_warnings
        assert all("nan" not in line for line in said)
        engine = lens_of(Intrinsics.model_validate(lens), list(HD))
        rays = engine.undistort(engine.border(16))
        engine.distort(rays.astype(np.float32))


def test_the_lenses_of_the_demo_and_of_the_documented_example_leave_nothing_to_be_said():
    demo = VenueIn.model_validate_json((Path(__file__).parents[3] / "demo" / "venue.json").read_bytes())
    for venue in (demo, VenueIn.model_validate(VENUE_EXAMPLE)):
        assert venue.to_venue().lens_warnings == []


def test_a_stored_lens_that_would_be_refused_today_is_searched_with_and_doubted():
    stored = VenueIn.model_validate(VENUE_EXAMPLE).to_venue()
    (left,) = stored.cameras
    blind = left.intrinsics.model_copy(update={"distortion": [-900.0, 0.0, 0.0, 0.0]})
    stored = stored.model_copy(update={"cameras": [left.model_copy(update={"intrinsics": blind})]})
    (sought,) = SoughtSite.of(stored, FindOptions(), ["left"]).cameras
    assert "no ray for 100 % of the picture" in lens_doubts(sought.intrinsics, sought.image_size)[0]
