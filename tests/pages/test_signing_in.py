"""A service that asks for keys, on its page."""

import httpx
import pytest
from playwright.sync_api import expect

from service.pages.page_rendering import local_target
from testbed.running import Service, keys_in, venue, wait_for
from tests.pages.browsing import grave
from tests.pages.reading import CHROME, shown_at

REFUSED = ("401", "403")


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    """The service, and a key of each scope."""
    folder = tmp_path_factory.mktemp("guarded")
    store = keys_in(folder)
    keys = {scope: store.add(scope, scope) for scope in ("read", "calibrate", "admin")}
    running = Service(folder, "serve")
    admin = {"Authorization": f"Bearer {keys['admin']}"}
    wait_for(lambda: running.http.put("/venues/field", json=venue("field"), headers=admin).status_code < 300)
    yield running, keys
    assert running.stop() == 0


def signed_in(service, key, to="/", **headers):
    """The answer to the form."""
    answer = service.http.post("/ui/sign-in", data={"key": key, "next": to}, headers=headers)
    # Otherwise the next request would be theirs.
    service.http.cookies.clear()
    return answer


def sign_in(page, key):
    page.get_by_label("Key").fill(key)
    page.get_by_role("button", name="Sign in").click()


@pytest.mark.long
def test_the_way_in_is_open_to_everybody(guarded, visit):
    page = visit(guarded[0].url, "/ui/venues/field")
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    assert grave(page) == []


def test_who_signs_in_comes_to_where_they_wanted_to_go_and_who_signs_out_is_out(guarded, visit):
    service, keys = guarded
    page = visit(service.url, "/ui/venues/field")
    sign_in(page, keys["calibrate"])
    page.wait_for_url("**/ui/venues/field")
    expect(page.get_by_text("Signed in as calibrate")).to_be_visible()
    expect(page.get_by_role("link", name="Calibrate")).to_be_visible()
    # Out of reach of scripts and of other sites.
    (cookie,) = page.context.cookies()
    assert (cookie["httpOnly"], cookie["sameSite"], cookie["secure"]) == (True, "Strict", False)
    assert page.evaluate("document.cookie") == ""
    page.get_by_role("button", name="Sign out").click()
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    assert page.context.cookies() == []
    kept = httpx.get(f"{service.url}/venues", headers={"Cookie": f"{cookie['name']}={cookie['value']}"})
    assert kept.json()["type"] == "/problems/session-over"


def test_a_link_leads_nobody_to_another_site_by_way_of_signing_in(guarded):
    service, keys = guarded
    there = "//evil.example/%5Cpath"
    assert there not in shown_at(service, f"/ui/sign-in?next={there}")
    assert signed_in(service, keys["read"], there).headers["Location"] == "/"


@pytest.mark.parametrize(
    "target",
    [
        "//evil.example/x",
        "///evil.example/x",
        "////evil.example",
        "/\\evil.example",
        "/\t/evil.example",
        "\t//evil.example",
        "/\n\\evil.example",
        "https://evil.example",
        "javascript:alert(1)",
        "evil.example",
        "",
    ],
)
def test_an_address_of_another_site_is_none_to_go_on_to(target):
    assert local_target(target) == "/"


@pytest.mark.parametrize("target", ["/", "/ui/venues/field", "/ui/jobs?status=failed&next=//x", "/a//b"])
def test_an_address_of_this_site_is_one_to_go_on_to(target):
    assert local_target(target) == target


def test_a_wrong_key_is_told_so(guarded, visit):
    page = visit(guarded[0].url, forgiven=REFUSED)
    sign_in(page, "esc_wrong")
    expect(page.get_by_role("alert")).to_contain_text("The key was not taken")
    expect(page.get_by_role("alert")).to_contain_text("of another service; esc key list names those of this.")


def test_behind_tls_the_cookie_stays_there(guarded):
    service, keys = guarded
    assert "Secure" in signed_in(service, keys["read"], **{"X-Forwarded-Proto": "https"}).headers["Set-Cookie"]


def test_who_may_only_read_finds_no_buttons_and_is_refused_without_them(guarded, visit):
    service, keys = guarded
    page = visit(service.url, "/ui/venues/field", forgiven=REFUSED)
    sign_in(page, keys["read"])
    expect(page.get_by_role("heading", name="Not calibrated yet")).to_be_visible()
    expect(page.get_by_role("link", name="Calibrate")).to_have_count(0)
    expect(page.get_by_role("button")).to_have_text(["Sign out"])
    status = page.evaluate(
        """() => fetch("/venues/field/restore", {
            method: "POST",
            headers: {
                "Content-Type": "application/json",
                "X-CSRF-Token": document.querySelector("meta[name=token]").content,
            },
            body: '{"revision": 1}',
        }).then((answer) => answer.status)"""
    )
    assert status == 403
    page.goto("/ui/new-venue")
    expect(page.get_by_text("This needs a key of scope admin")).to_be_visible()


def test_nothing_is_changed_without_the_token_of_the_page(guarded):
    service, keys = guarded
    jar = {"Cookie": signed_in(service, keys["admin"]).headers["Set-Cookie"].partition(";")[0]}
    refused = service.http.delete("/venues/field", headers=jar)
    assert refused.json()["type"] == "/problems/token-missing"
    assert service.http.get("/venues/field", headers=jar).status_code == 200


@pytest.mark.parametrize(
    "headers", [{"Sec-Fetch-Site": "cross-site"}, {"Origin": "http://evil.example"}, {"Origin": "null"}]
)
def test_no_other_site_signs_anybody_in(guarded, headers):
    service, keys = guarded
    answer = service.http.post("/ui/sign-in", data={"key": keys["read"]}, headers=headers)
    assert answer.status_code == 403
    assert "Set-Cookie" not in answer.headers


def test_where_no_keys_are_asked_for_there_is_nothing_to_sign_in_to(stub):
    answer = stub.http.get("/ui/sign-in", headers={"Accept": CHROME}, follow_redirects=True)
    assert (answer.url.path, "Sign out" in answer.text) == ("/", False)
