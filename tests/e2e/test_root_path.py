"""A service below a path of another site, behind a proxy that leaves the path on requests and one that takes it off."""

import re
import shutil

import pytest

from service.client import Client
from testbed.parameters import try_first
from testbed.running import Service, keys_in, png, venue
from tests.e2e.proxies import NAME, Caddy, Nginx
from tests.e2e.routes.event_stream import Stream

ROOT = "/truck/esc"
# Addresses of ours in a page: none may begin at the root of the host.
BESIDE = re.compile(rf'="/(?!{ROOT[1:]}[/"])')


@pytest.fixture(scope="module")
def below(tmp_path_factory):
    folder = tmp_path_factory.mktemp("below")
    key = keys_in(folder).add("ops", "admin")
    running = Service(folder, ESC_ROOT_PATH=f"{ROOT}/").ready()
    yield running, key
    running.kill()


@pytest.fixture(scope="module", params=try_first([Nginx, Caddy]), ids=lambda kind: kind.program)
def proxy(request, below, missing, tmp_path_factory):
    if shutil.which(request.param.program) is None:
        missing(request.param.program)
    one = request.param(tmp_path_factory.mktemp(request.param.program), below[0], ROOT)
    yield one
    one.stop()


@pytest.fixture
def http(proxy, below, name):
    with proxy.client(below[1]) as client:
        client.put(f"/venues/{name}", json=venue(name)).raise_for_status()
        yield client


def test_where_an_answer_leads_to_is_below_the_path(http, name):
    files = [(camera, (f"{camera}.png", png())) for camera in ("left", "right")]
    sent = http.post(f"/venues/{name}/calibrate", files=files)
    assert sent.headers["location"] == f"{ROOT}/jobs/{sent.json()['id']}"
    ended = http.get(sent.url.join(sent.headers["location"]), params={"wait": 60}).json()
    assert (ended["status"], ended["links"]["self"]) == ("succeeded", f"/jobs/{ended['id']}")


@pytest.mark.parametrize("path", ["/venues", "/venues/v/calibrate", "/ui/jobs", "/docs"])
@pytest.mark.parametrize("host", ["evil.example", "evil.example:8000"])
def test_an_address_with_one_slash_too_many_leads_below_the_path_of_the_same_host(below, path, host):
    service, key = below
    said = {"Host": host, "Authorization": f"Bearer {key}"}
    asks = service.http.post if path.endswith("calibrate") else service.http.get
    for asked in (f"{ROOT}{path}/?limit=1", f"{path}/?limit=1"):
        answer = asks(asked, headers=said, follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (307, f"{ROOT}{path}?limit=1")


@pytest.mark.parametrize("host", ["[", "[::1", "a b", "a:b:c"])
def test_a_host_that_is_none_is_no_mistake_of_the_service(below, host):
    for path in ("/venues/", "/nothing", "/ui/jobs"):
        assert below[0].http.get(f"{ROOT}{path}", headers={"Host": host}, follow_redirects=False).status_code < 500


def test_every_address_of_every_page_is_below_the_path(http, name):
    files = [(camera, (f"{camera}.png", png())) for camera in ("left", "right")]
    job = http.post(f"/venues/{name}/calibrate", files=files).json()["id"]
    http.get(f"/jobs/{job}", params={"wait": 60})
    of_venue = ("", "/settings", "/ignore", "/calibrate", "/find", "/first-pose")
    others = ("/", "/docs", "/ui/jobs", f"/ui/jobs/{job}", "/ui/new-venue", "/ui/new-venue/by-hand")
    for address in (*others, "/refusals/residual", *(f"/ui/venues/{name}{page}" for page in of_venue)):
        page = http.get(address, headers={"Accept": "text/html"})
        assert page.status_code == 200, address
        assert BESIDE.findall(page.text) == [], address


def test_the_next_page_of_a_list_is_below_the_path(http, name):
    http.put(f"/venues/{name}-2", json=venue(f"{name}-2")).raise_for_status()
    first = http.get("/venues", params={"limit": 1})
    following = http.get(first.url.join(first.links["next"]["url"]))
    assert following.json()["venues"] != first.json()["venues"]


def test_the_document_says_where_the_service_is(http):
    assert http.get("/openapi.json").json()["servers"] == [{"url": ROOT}]


def test_events_arrive_below_the_path(http, name):
    with http.stream("GET", f"/venues/{name}/events") as answer:
        assert Stream(answer).next()["event"] == "poses.current"


def test_the_client_is_given_the_address_with_the_path(proxy, below, name, monkeypatch, tmp_path):
    monkeypatch.setenv("SSL_CERT_FILE", str(proxy.folder / "certificate.pem"))
    with Client(proxy.url, below[1]) as client, proxy.client(below[1]) as http:
        http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
        (tmp_path / "frame.png").write_bytes(png())
        job = client.calibrate(name, dict.fromkeys(("left", "right"), tmp_path / "frame.png"), {})
        ended = client.job(job.id, wait_s=60)
        assert ended.status == "succeeded"
        assert client.picture(ended, "preview") is not None
        assert client.url_of(ended.links["self"]) == f"{proxy.url}/jobs/{job.id}"


def test_who_signs_in_is_led_below_the_path_and_the_cookie_stays_there(proxy, below):
    with proxy.client(Origin=f"https://{NAME}:{proxy.https_port}") as browser:
        asked = browser.get("/ui/jobs")
        assert asked.headers["location"] == f"{ROOT}/ui/sign-in?next=/ui/jobs"
        signed_in = browser.post("/ui/sign-in", data={"key": below[1], "next": "/ui/jobs"})
        assert signed_in.headers["location"] == f"{ROOT}/ui/jobs"
        assert f"Path={ROOT};" in signed_in.headers["set-cookie"]
        assert browser.get("/ui/jobs").status_code == 200


def test_beside_the_proxy_it_answers_with_and_without_the_path(below):
    for path in ("/livez", f"{ROOT}/livez"):
        assert below[0].http.get(path).status_code == 200
    assert below[0].http.get(f"{ROOT}-2/livez").status_code == 404
