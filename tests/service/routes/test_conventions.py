"""HTTP conventions: conditions, pages, and the size of answers."""

import httpx
import pytest

from testbed.running import venue
from tests.problems import problem_of


def test_a_weak_tag_is_no_condition_for_a_change_and_one_for_a_read(service, name):
    service.venue(name)
    path = f"/venues/{name}"
    tag = service.http.get(path).headers["etag"]
    read = service.http.get(path, headers={"If-None-Match": f"W/{tag}"})
    assert read.status_code == 304
    refused = service.http.put(path, json=venue(name), headers={"If-Match": f"W/{tag}"})
    assert problem_of(refused) == (412, "venue-changed")
    assert service.http.put(path, json=venue(name), headers={"If-Match": f'W/"x", {tag}'}).status_code == 200


def test_a_patch_of_another_type_is_told_which_is_taken(service, name):
    service.venue(name)
    refused = service.http.patch(f"/venues/{name}", content=b"{}", headers={"Content-Type": "text/plain"})
    assert problem_of(refused) == (415, "not-json")
    assert refused.headers["accept-patch"] == "application/merge-patch+json"
    assert "accept-patch" not in service.http.put(f"/venues/{name}", content=b"{}").headers


@pytest.mark.parametrize(
    "path", ["/jobs?kind=calibration&limit=2", "/venues?limit=1", "/venues/{name}/history?limit=1"]
)
def test_every_page_but_the_last_has_a_link_to_the_next(service, name, path):
    service.venue(f"{name}-2")
    for shade in range(3):
        service.calibrated(service.venue(name), shade)
    address, pages = httpx.URL(service.url).join(path.format(name=name)), []
    while True:
        page = service.http.get(address)
        (rows,) = [rows for key, rows in page.json().items() if key != "next_cursor"]
        pages.append(rows)
        if "next" not in page.links:
            break
        address = page.url.join(page.links["next"]["url"])
    assert page.json()["next_cursor"] is None
    assert len(pages) > 1
    with_cursor = service.http.get(path.format(name=name)).json()["next_cursor"]
    assert service.http.get(path.format(name=name), params={"cursor": with_cursor}).status_code == 200
    assert len({str(row) for rows in pages for row in rows}) == sum(map(len, pages))


def test_an_answer_names_the_first_hundred_mistakes_and_counts_the_others(service, name):
    document = venue(name) | {f"unknown_{number}": 1 for number in range(30_000)}
    refused = service.http.put(f"/venues/{name}", json=document)
    assert refused.status_code == 422
    assert (len(refused.json()["errors"]), refused.json()["errors_left_off"]) == (100, 29_900)
    assert len(refused.content) < 50_000
    few = service.http.put(f"/venues/{name}", json=venue(name) | {"unknown": 1})
    assert "errors_left_off" not in few.json()
