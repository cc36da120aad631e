"""A browser on the operator's page: Debian's Chromium, and what it must never have to complain about."""

import json
import shutil
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Browser, BrowserContext, Error, Locator, Page, Route, expect, sync_playwright

from testbed.running import wait_for

# In place of Playwright's own list, of which those are kept that these pages depend on.
DISABLED_FEATURES = [
    # With this one Chromium 156 at times never answers that a page is closed which loads itself again at that moment.
    "RenderDocument",
    "AvoidCorsURLLoaderRestartOnRedirect",
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "PaintHolding",
]
ARGUMENTS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    f"--disable-features={','.join(DISABLED_FEATURES)}",
]
AXE = Path(__file__).parent / "vendor" / "axe.min.js"
PATIENCE_MS = 120_000
SCHEMES = ("light", "dark")
LOADED = """
part => Promise.all([...part.querySelectorAll("img")].filter((one) => one.checkVisibility()).map((one) => one.decode()))
"""
ASK_AXE = "tags => axe.run(document, {resultTypes: ['violations'], ...(tags && {runOnly: tags})})"
OF_COLOURS = ["cat.color"]
# Called before any script of a page: what the policy refuses is no console message in every browser.
WATCH_POLICY = """
addEventListener("securitypolicyviolation", (event) => violated(`${event.violatedDirective}: ${event.blockedURI}`));
"""
# Tabs of a person that tests have left, each with the list of its complaints. To look at a page in one of them takes a
# core a quarter of a second less than in a new one.
_left: dict[BrowserContext, list[tuple[Page, list[str]]]] = defaultdict(list)


def chromium() -> str | None:
    """The path of Chromium without windows, which draws the same for two thirds of the time; else of the whole one."""
    return shutil.which("chromium-headless-shell") or shutil.which("chromium")


@contextmanager
def browser_at(path: str) -> Iterator[Browser]:
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()


@contextmanager
def person(
    browser: Browser, url: str, scheme: str = "dark", size: tuple[int, int] = (1280, 900), zone: str = "UTC"
) -> Iterator[BrowserContext]:
    """Somebody who looks at a service; what the browser keeps for them is theirs."""
    # What turns while a job runs is drawn sixty times a second, and no test looks at it.
    how = {"viewport": {"width": size[0], "height": size[1]}, "reduced_motion": "reduce"}
    context = browser.new_context(base_url=url, color_scheme=scheme, timezone_id=zone, **how)
    context.set_default_timeout(PATIENCE_MS)
    try:
        yield context
    finally:
        _left.pop(context, None)
        context.close()


@contextmanager
def tab(context: BrowserContext, forgiven: tuple[str, ...] = ()) -> Iterator[Page]:
    """A page of a person. Errors on the console but those that contain what is `forgiven` fail the test.

    A browser writes there by itself that an answer was an error, such as 422 for a form that was to be refused.
    """
    page, complaints = _left[context].pop() if _left[context] else _open(context)
    size = page.viewport_size
    try:
        yield page
    finally:
        unforgiven = [one for one in complaints if not any(part in one for part in forgiven)]
        try:
            _leave(page)
            page.set_viewport_size(size)
        except Error:
            # A test has closed it, or it is on its way to somewhere.
            page.close()
        else:
            complaints.clear()
            _left[context].append((page, complaints))
    assert not unforgiven, unforgiven


def _open(context: BrowserContext) -> tuple[Page, list[str]]:
    """Open a tab whose errors are noted."""
    complaints: list[str] = []
    page = context.new_page()
    page.expose_function("violated", lambda what: complaints.append(f"policy: {what}"))
    page.add_init_script(WATCH_POLICY)
    page.on("console", lambda said: complaints.append(f"{said.type}: {said.text}") if said.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(f"script: {error}"))
    return page, complaints


def _leave(page: Page) -> None:
    """Leave nothing of a test in its tab: neither its page nor what that keeps for the tab, its routes, its pointer."""
    page.unroute_all(behavior="ignoreErrors")
    page.evaluate("sessionStorage.clear()")
    page.goto("about:blank")
    page.mouse.move(0, 0)


def press_and_confirm(button: Locator) -> str:
    """Press a button that asks first, and let it happen; returns what was asked and what was said to come."""
    button.click()
    box = button.page.get_by_role("dialog")
    words = " ".join(box.locator("h2, p").all_inner_texts())
    box.get_by_role("button").first.click()
    return words


def keep_one_path(page: Page, kept: str) -> None:
    """Let the page of the interface draw one path of the document: all of them take a core five seconds."""

    def cut(route: Route) -> None:
        answer = route.fetch()
        document = answer.json()
        route.fulfill(response=answer, body=json.dumps(document | {"paths": {kept: document["paths"][kept]}}))

    page.route("**/openapi.json", cut)


def look(part: Page | Locator) -> np.ndarray:
    """Return a screenshot of a page or a part of it (BGR), after the pictures inside have been loaded."""
    if isinstance(part, Locator):
        # Pictures are loaded when they are about to be seen, and those of a layer when it is first switched on.
        part.scroll_into_view_if_needed()
        part.evaluate(LOADED)
    return cv2.imdecode(np.frombuffer(part.screenshot(), np.uint8), cv2.IMREAD_COLOR)


def wait_until(page: Page, true: str) -> None:
    """Until an expression of JavaScript is true.

    Asked anew by the debugger each time: what Playwright leaves in a page to ask for itself is refused by its policy.
    """
    wait_for(lambda: page.evaluate(true), PATIENCE_MS / 1000)


def differs(one: np.ndarray, other: np.ndarray) -> float:
    """The share of pixels that are clearly different."""
    return float((np.abs(one.astype(int) - other.astype(int)).max(axis=-1) > 24).mean())


def in_each_scheme(page: Page) -> Iterator[str]:
    """Show an open page in light colours and then in dark ones: its style sheet alone knows of them."""
    for scheme in SCHEMES:
        page.emulate_media(color_scheme=scheme)
        yield scheme


def grave(page: Page) -> list[str]:
    """Return axe-core's serious findings: obstacles for people with a screen reader, a keyboard or weak eyes.

    The colour schemes differ in colours alone, so only the rules about colours are checked in both.
    """
    # Evaluated by the debugger: the policy of the page would refuse a script from elsewhere.
    page.evaluate(AXE.read_text())
    found = [
        (scheme, one)
        for scheme in in_each_scheme(page)
        for one in page.evaluate(ASK_AXE, None if scheme == SCHEMES[0] else OF_COLOURS)["violations"]
    ]
    return [
        f"{scheme}: {one['impact']}: {one['id']}: {one['nodes'][0]['html'][:200]} "
        f"{one['nodes'][0]['failureSummary'][:300]}"
        for scheme, one in found
        if one["impact"] in ("serious", "critical")
    ]


def list_from(venue: str) -> str:
    """Return the address of the list of venues from about this venue on: other tests fill its first page."""
    return f"/?after={venue[:-1]}"
