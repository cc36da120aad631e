"""The pages of a service below a path of another site: nothing that a browser asks for is beside that path."""

import shutil
from urllib.parse import urlsplit

import pytest

from testbed.running import Service, png, venue
from tests.e2e.proxies import Nginx
from tests.pages.browsing import PATIENCE_MS, keep_one_path, tab

pytestmark = pytest.mark.long
ROOT = "/esc"


@pytest.fixture(scope="module")
def proxied(tmp_path_factory, missing):
    if shutil.which(Nginx.program) is None:
        missing(Nginx.program)
    service = Service(tmp_path_factory.mktemp("below"), ESC_ROOT_PATH=ROOT, ESC_ALLOWED_HOSTS='["localhost"]').ready()
    proxy = Nginx(tmp_path_factory.mktemp("nginx"), service, ROOT)
    yield proxy
    proxy.stop()
    service.kill()


@pytest.fixture
def below(browser, proxied):
    """A page of it, and the addresses that it has asked for."""
    asked: list[str] = []
    context = browser.new_context(base_url=proxied.url, ignore_https_errors=True)
    context.set_default_timeout(PATIENCE_MS)
    context.on("request", lambda request: asked.append(urlsplit(request.url).path))
    with tab(context) as page:
        yield page, asked
    context.close()


def test_a_venue_is_made_calibrated_and_looked_at_below_the_path(below, proxied):
    name, (page, asked) = "walked", below
    with proxied.client() as http:
        http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    page.goto(f"{proxied.url}/")
    page.locator(f"a[href$='/ui/venues/{name}']").click()
    page.get_by_role("link", name="Calibrate", exact=True).click()
    for number in range(2):
        page.locator("input[type=file]").nth(number).set_input_files(
            {"name": f"{number}.png", "mimeType": "image/png", "buffer": png()}
        )
    page.get_by_role("button", name="Calibrate", exact=True).click()
    page.wait_for_url(f"{proxied.url}/ui/jobs/*")
    first = page.url
    page.get_by_role("button", name="Again").click()
    page.wait_for_url(lambda url: url != first and urlsplit(url).path.startswith(f"{ROOT}/ui/jobs/"))
    # It follows its venue once its scripts have run.
    with page.expect_request(f"**{ROOT}/venues/{name}/events"):
        page.locator(f"a[href$='/ui/venues/{name}']").first.click()
    keep_one_path(page, "/venues/{venue_id}")
    for address in ("/ui/new-venue/by-hand", f"/ui/venues/{name}/settings", f"/ui/venues/{name}/ignore", "/docs"):
        page.goto(f"{proxied.url}{address}")
    page.locator("rapi-doc").get_by_text("PUT").first.wait_for()
    assert not [path for path in asked if not path.startswith(f"{ROOT}/")]
    assert {f"{ROOT}/openapi.json", f"{ROOT}/venues/{name}/events"} <= set(asked)
