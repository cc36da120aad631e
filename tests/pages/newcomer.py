"""Somebody with two frames and the numbers of two lenses, who has never seen the service before."""

import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import FilePayload, Page, expect

import demo
from service.schemas.geometry import Pose
from service.schemas.venue import VenueIn
from worker.calibration.geometry.camera import Camera
from worker.jobs.from_schemas import camera_of, pitch_of

DEMO = Path(demo.__file__).parent
# The demo's frames are 4K: a quarter of the pixels is enough.
SCALE = 0.5


def scaled() -> VenueIn:
    """The venue of the demo, with smaller frames."""
    venue = json.loads((DEMO / "venue.json").read_text())
    for camera in venue["cameras"]:
        camera["image_size"] = [round(SCALE * side) for side in camera["image_size"]]
        (fx, _, cx), (_, fy, cy), last = camera["intrinsics"]["matrix"]
        camera["intrinsics"]["matrix"] = [
            [SCALE * fx, 0, SCALE * (cx + 0.5) - 0.5],
            [0, SCALE * fy, SCALE * (cy + 0.5) - 0.5],
            last,
        ]
    return VenueIn.model_validate(venue)


VENUE = scaled().to_venue()
TRUTH = {
    camera: Pose.from_position(**pose)
    for camera, pose in json.loads((DEMO / "truth.json").read_text())["poses"].items()
}
# What can be clicked well: crossings of lines, on both sides of each frame.
CLICKED = 5
# Two cameras of which nothing is known take a minute and a half of a core, of which others may have a share.
FINDING_MS = 600_000


@cache
def frame(camera: str) -> FilePayload:
    """A file of what a camera shows."""
    whole = cv2.imread(str(DEMO / f"{camera}.jpg"))
    smaller = cv2.resize(whole, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_AREA)
    return {"name": f"{camera}.jpg", "mimeType": "image/jpeg", "buffer": cv2.imencode(".jpg", smaller)[1].tobytes()}


def finds_the_cameras(page: Page) -> str:
    """From an empty service to a venue by two frames and the sport, by three clicks; returns the job's id."""
    page.goto("/ui/new-venue")
    drop_the_frames(page)
    find = page.get_by_role("button", name="Find the cameras")
    expect(find).to_be_enabled()
    find.click()
    page.wait_for_url("**/ui/jobs/*")
    job = page.url.rpartition("/")[2]
    take = page.get_by_role("button", name="Create the venue")
    expect(take).to_be_enabled(timeout=FINDING_MS)
    take.click()
    # The calibration that follows has a page of its own.
    page.wait_for_url(lambda url: not url.endswith(job))
    return job


def drop_the_frames(page: Page) -> None:
    """Choose a frame of each camera. Football is the default, and the files are named like the cameras."""
    page.locator("#frames .drop-zone input").set_input_files([frame(camera.id) for camera in VENUE.cameras])
    expect(page.locator(".found-frames canvas")).to_have_count(len(VENUE.cameras))


def goes_the_whole_way(page: Page) -> None:
    """From an empty service to an accepted pose."""
    page.goto("/")
    page.get_by_role("link", name="New venue").click()
    page.get_by_role("link", name="By hand").click()
    describe_the_pitch(page)
    for number, camera in enumerate(VENUE.cameras):
        if number:
            page.get_by_role("button", name="Add a camera").click()
        describe_a_camera(page, number)
        click_points(page, number, camera.id)
    create = page.get_by_role("button", name="Create and calibrate")
    expect(create).to_be_enabled()
    create.click()
    page.wait_for_url("**/ui/jobs/*")
    # Loads itself again at the end of the job.
    expect(page.locator(".title .badge")).to_have_text("Accepted", timeout=300_000)


def describe_the_pitch(page: Page) -> None:
    field = VENUE.field
    page.get_by_label("Id", exact=True).first.fill("newcomer")
    page.get_by_label("Name", exact=True).fill("A newcomer's pitch")
    page.get_by_label("Length, m").fill(str(field.length_m))
    page.get_by_label("Width, m", exact=True).fill(str(field.width_m))
    page.get_by_label("Height of the ridge, m").fill(str(field.ridge[0][2]))


def describe_a_camera(page: Page, number: int) -> None:
    camera = VENUE.cameras[number]
    step = page.locator(".camera-step").nth(number)
    step.get_by_label("Id", exact=True).fill(camera.id)
    step.get_by_label("A frame of it").set_input_files(frame(camera.id))
    (fx, _, cx), (_, fy, cy), _ = camera.intrinsics.matrix
    for name, value in (("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)):
        step.get_by_label(f"{name}, px").fill(str(value))
    step.get_by_label("Distortion").fill(", ".join(map(str, camera.intrinsics.distortion)))


def click_points(page: Page, number: int, camera: str) -> None:
    step = page.locator(".camera-step").nth(number)
    frame = step.locator("canvas[data-frame]")
    frame.scroll_into_view_if_needed()
    for name, pixel in points_to_click(camera).items():
        step.locator("[data-point]").select_option(name)
        box = frame.bounding_box()
        place = (np.array(pixel) + 0.5) / VENUE.cameras[number].image_size * [box["width"], box["height"]]
        frame.click(position={"x": float(place[0]), "y": float(place[1])})
    expect(step.locator("[data-verdict]")).to_contain_text("Good")


def points_to_click(camera: str) -> dict[str, list[float]]:
    """Named points that are in view, and where: the first by x, the last, and those between them evenly."""
    standing = true_camera(camera)
    width, height = standing.intrinsics.size
    pitch = pitch_of(VENUE.field)
    names = sorted(VENUE.field.plan.places(VENUE.field.size))
    pixels = standing.project(np.stack([pitch.place(name) for name in names]))
    inside = (pixels > 30).all(axis=1) & (pixels < [width - 30, height - 30]).all(axis=1)
    seen = sorted((pixel.tolist(), name) for name, pixel, visible in zip(names, pixels, inside, strict=True) if visible)
    chosen = np.unique(np.linspace(0, len(seen) - 1, CLICKED).astype(int))
    return {seen[index][1]: seen[index][0] for index in chosen}


def true_camera(camera: str) -> Camera:
    """The camera as it really stands."""
    (stored,) = (one for one in VENUE.cameras if one.id == camera)
    return camera_of(stored.model_copy(update={"pose": TRUTH[camera]}))
