"""Pictures of every page, light and dark, for the documents: `python -m tests.pages.screenshots build/pages`.

Starts a service with the real engine, goes the newcomer's way on it, and fills a second venue with a month of results.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Browser, Page

from demo.__main__ import service
from service.settings import Settings
from service.store.database import connect, writing
from testbed.running import venue
from tests.pages import newcomer
from tests.pages.browsing import browser_at, chromium, person, tab
from tests.pages.stocked import LIVE, calibrations, live_minutes

DESK, PHONE = (1280, 860), (390, 844)
WEBP_QUALITY = 82
# Taken as long as they are, up to this.
TALLEST = 2400


def main(folder: Path) -> None:
    """Take them all."""
    folder.mkdir(parents=True, exist_ok=True)
    path = chromium()
    if path is None:
        raise SystemExit("install Chromium (Debian: apt-get install chromium-headless-shell, or chromium)")
    with tempfile.TemporaryDirectory(prefix="esc-pages-") as data, service(Path(data)) as url, browser_at(path) as one:
        with person(one, url) as somebody, tab(somebody) as page:
            search = newcomer.finds_the_cameras(page)
            newcomer.goes_the_whole_way(page)
            job = page.url.rpartition("/")[2]
            stock(page, Path(data))
        for scheme in ("dark", "light"):
            take_all(one, url, job, search, scheme, folder)


def stock(page: Page, data: Path) -> None:
    """More venues than one, with something to see."""
    for name, called in (("north", "North pitch"), ("south", "South pitch, cameras on the stand's roof")):
        page.request.put(f"/venues/{name}", data=venue(name, called))
    engine = connect(Settings(data=data).home_database_url)
    with writing(engine) as connection:
        calibrations(connection, "north", 200)
        live_minutes(connection, "south", 25)
    engine.dispose()


def take_all(browser: Browser, url: str, job: str, search: str, scheme: str, folder: Path) -> None:
    with person(browser, url, scheme, DESK) as somebody, tab(somebody) as page:
        for name, address in (
            ("venues", "/"),
            ("venue", "/ui/venues/newcomer"),
            ("history", "/ui/venues/north"),
            ("live", "/ui/venues/south"),
            ("jobs", "/ui/jobs"),
            ("job", f"/ui/jobs/{job}"),
            ("found", f"/ui/jobs/{search}"),
            ("calibrate", "/ui/venues/newcomer/calibrate"),
            ("ignore", "/ui/venues/newcomer/ignore"),
            ("settings", "/ui/venues/newcomer/settings"),
            ("refusal", "/refusals/residual"),
        ):
            if name == "live":
                page.request.put("/venues/south/live", data=LIVE)
            page.goto(address)
            page.wait_for_load_state("networkidle")
            if name == "calibrate":
                for camera in ("left", "right"):
                    page.locator(f"[data-camera={camera}] input[type=file]").set_input_files(newcomer.frame(camera))
                page.locator(".thumbs canvas").nth(1).wait_for()
            save(page, folder / f"{name}-{scheme}.webp")
        page.goto("/ui/plan")
        page.get_by_role("button", name="Plan", exact=True).click()
        page.locator("#map").wait_for()
        page.wait_for_load_state("networkidle")
        save(page, folder / f"plan-{scheme}.webp")
        page.goto("/ui/new-venue")
        newcomer.drop_the_frames(page)
        save(page, folder / f"new-venue-{scheme}.webp")
        page.goto("/ui/new-venue/by-hand")
        newcomer.describe_the_pitch(page)
        page.get_by_label("Id", exact=True).first.fill("south-pitch")
        newcomer.describe_a_camera(page, 0)
        newcomer.click_points(page, 0, "left")
        save(page, folder / f"new-venue-by-hand-{scheme}.webp")
    with person(browser, url, scheme, PHONE) as somebody, tab(somebody) as page:
        for name, address in (("venues", "/"), ("venue", "/ui/venues/newcomer")):
            page.goto(address)
            page.wait_for_load_state("networkidle")
            save(page, folder / f"{name}-phone-{scheme}.webp")


def save(page: Page, path: Path) -> None:
    """The whole page, or as much of it as a reader looks at."""
    tall = min(TALLEST, page.evaluate("document.documentElement.scrollHeight"))
    width = page.viewport_size["width"]
    shot = page.screenshot(full_page=True, clip={"x": 0, "y": 0, "width": width, "height": tall})
    picture = cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR)
    cv2.imwrite(str(path), picture, [cv2.IMWRITE_WEBP_QUALITY, WEBP_QUALITY])
    print(f"{path} {path.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    (target,) = sys.argv[1:] or ["build/pages"]
    main(Path(target))
