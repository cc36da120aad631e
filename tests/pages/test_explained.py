"""Explanations of refusals and problems: pages for people, JSON for programs; and links between all pages."""

import re

import httpx
import numpy as np
import pytest
from playwright.sync_api import expect

from service.pages import documents
from service.pages.problem_pages import DOCUMENT_NAME, wants_page
from service.schemas.problems import PROBLEM_TYPES, REFUSAL_REASONS
from testbed.running import Service, keys_in
from tests.pages.browsing import in_each_scheme, keep_one_path, look, wait_until
from tests.pages.reading import CHROME, shown_at, words_of


@pytest.mark.parametrize(
    ("accept", "page"),
    [
        (CHROME, True),
        ("text/html", True),
        ("", False),
        ("*/*", False),
        ("application/json", False),
        ("application/json, text/html;q=0.9", False),
        ("text/html, application/problem+json", False),
        ("text/html;q=0", False),
        ("text/html;q=nonsense", False),
    ],
)
def test_who_likes_a_page_better_than_json_gets_one(accept, page):
    assert wants_page(accept) is page


@pytest.mark.parametrize("path", ["/refusals/residual", "/problems/no-markings-in-view"])
def test_programs_get_json_and_browsers_a_page_at_the_same_address(stub, path):
    json = stub.http.get(path)
    assert json.headers["content-type"] == "application/json"
    assert json.json()["title"]
    page = stub.http.get(path, headers={"Accept": CHROME})
    assert page.headers["content-type"].startswith("text/html")
    assert json.json()["title"] in page.text
    assert json.headers["vary"] == page.headers["vary"] == "Accept"


def test_the_reason_beside_a_camera_leads_to_what_the_document_says_of_it(stub, visit):
    page = visit(stub.url, "/refusals/residual")
    expect(page.get_by_role("heading", level=1)).to_have_text("Lines are beside where the pose puts them")
    expect(page.get_by_text("The blue drawing crosses the lines.")).to_be_visible()
    expect(page.get_by_text("Limit: 2.4 px")).to_be_visible()
    # What the same part of the document says of other reasons stays there.
    expect(page.get_by_text("few-lines")).to_have_count(0)
    page.get_by_role("link", name="Refused, and what now: the whole document").click()
    expect(page).to_have_url(re.compile("/ui/documents/refused#the-lines$"))
    expect(page.locator("#the-lines")).to_be_in_viewport()
    page.get_by_role("link", name="first pose", exact=True).first.click()
    expect(page.get_by_role("heading", level=1)).to_have_text(documents.title("first-calibration"))


@pytest.mark.parametrize("reason", REFUSAL_REASONS)
def test_every_reason_has_a_part_of_the_document(reason):
    assert f"<code>{reason}</code>" in documents.reason(DOCUMENT_NAME, REFUSAL_REASONS[reason].anchor, reason)


@pytest.mark.parametrize("kind", ["no-markings-in-view", "job-crashed", "frame-size"])
def test_what_a_job_failed_with_is_explained_with_what_to_do(stub, kind):
    shown = shown_at(stub, f"/problems/{kind}")
    assert f"<h1>{PROBLEM_TYPES[kind].title}</h1>" in shown
    assert re.search(rf"<tr>\s*<td>.*<code>{kind}</code>", shown)


def test_a_problem_of_requests_says_so(stub):
    assert "A request was answered so, with the status 415." in words_of(shown_at(stub, "/problems/not-json"))


@pytest.mark.parametrize("name", documents.NAMES)
def test_every_link_of_a_document_leads_to_a_heading_that_is_there(name):
    targets = re.findall(r'href="([^"]*)"', documents.whole(name))
    for target in targets:
        of, _, anchor = target.removeprefix("/ui/documents/").partition("#")
        assert of in documents.NAMES, target
        assert not anchor or f'id="{anchor}"' in documents.whole(of) or anchor == "refused-and-what-now", target


@pytest.mark.parametrize("kind", ["refusals", "problems"])
def test_all_reasons_are_listed_for_browsers(stub, kind):
    listed = re.findall(r'<li>\s*<a href="([^"]*)"', shown_at(stub, f"/{kind}"))
    assert listed == [f"/{kind}/{one}" for one in (REFUSAL_REASONS if kind == "refusals" else PROBLEM_TYPES)]
    assert stub.http.get(f"/{kind}").headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("/nowhere", "Nothing is at /nowhere."),
        ("/ui/venues/nope", "Somebody has deleted it, or the address is mistyped."),
        ("/ui/venues/NO!", "The address is not one of this service's."),
        ("/ui/jobs/nope", "Somebody has deleted it, or the address is mistyped."),
        (
            "/ui/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
            "It was deleted: by somebody, or since it ended more than 400 days ago.",
        ),
        ("/refusals/whim", "There is no such reason for a refusal."),
    ],
)
def test_where_nothing_is_people_find_a_page_without_a_word_of_requests(stub, path, words):
    shown = shown_at(stub, path, 404)
    assert words in words_of(shown)
    assert not re.search(r"\b(GET|PUT|POST|PATCH|DELETE) /", words_of(shown))
    assert re.search(r"<title>[^<]*ESC", shown)
    assert "To the venues</a>" in shown


@pytest.mark.long
def test_the_interface_is_drawn_without_internet_has_a_way_back_and_speaks_of_no_key_where_none_is_asked_for(
    stub, visit
):
    page, asked = visit(stub.url, "/livez"), []
    page.on("request", lambda request: asked.append(request.url))
    # What the policy of the page refuses fails the test too.
    page.goto("/docs")
    expect(page.get_by_text("venues", exact=True).first).to_be_visible()
    expect(page.get_by_text("No API key applied")).to_have_count(0)
    assert f"{stub.url}/openapi.json" in asked
    assert [url for url in asked if not url.startswith((f"{stub.url}/", "data:"))] == []
    page.get_by_role("link", name="Venues").click()
    expect(page).to_have_url(f"{stub.url}/")


@pytest.mark.long
def test_the_interface_takes_a_key_where_one_is_asked_for_and_has_the_colours_that_the_browser_prefers(tmp_path, visit):
    keys_in(tmp_path).add("reader", "read")
    service = Service(tmp_path, "serve")
    page = visit(service.url, "/livez", forgiven=("401",))
    keep_one_path(page, "/venues")
    page.goto("/docs")
    expect(page.get_by_text("No API key applied")).to_be_visible()
    for scheme in in_each_scheme(page):
        wait_until(page, f"document.querySelector('rapi-doc').getAttribute('theme') == '{scheme}'")
        assert (np.median(look(page)) < 64) == (scheme == "dark")
    page.close()
    service.kill()


def test_a_browser_finds_a_sign_for_addresses_that_name_none(stub):
    sign = httpx.get(f"{stub.url}/favicon.ico")
    assert (sign.status_code, sign.headers["content-type"]) == (200, "image/svg+xml")
