"""Lists in lines, and lists of what is looked for."""

import pytest

from testbed.homes import in_both_homes
from testbed.running import venue


def listed(service, path, **chosen):
    answer = service.http.get(path, params=chosen)
    assert answer.status_code == 200, answer.text
    return answer.json()


def ids(page):
    return [one["id"] for one in page["venues"]]


@in_both_homes
def test_a_summary_of_jobs_says_how_each_ended_without_its_result(service, name):
    whole = service.calibrated(service.venue(name))
    failed = service.end(service.submit(service.venue(name, "fail")).json()["id"])
    page = listed(service, "/jobs", venue=name, fields="summary")
    assert page["jobs"] == []
    last, first = page["summaries"]
    assert (last["id"], last["verdict"], last["error"]) == (failed["id"], None, failed["error"])
    same = {key: value for key, value in whole.items() if key in first}
    assert first == same | {key: whole["result"][key] for key in ("verdict", "stitch_error_px")}
    assert not {"result", "options", "frames"} & first.keys()
    assert "summaries" not in listed(service, "/jobs", venue=name)


@in_both_homes
def test_summaries_come_in_the_same_pages(service, name):
    for shade in range(2):
        service.calibrated(service.venue(name), shade)
    newest = listed(service, "/jobs", venue=name, fields="summary", limit=1)
    oldest = listed(service, "/jobs", venue=name, fields="summary", limit=1, cursor=newest["next_cursor"])
    both = [job["id"] for job in listed(service, "/jobs", venue=name)["jobs"]]
    assert [page["summaries"][0]["id"] for page in (newest, oldest)] == both
    assert oldest["next_cursor"] is None


@in_both_homes
def test_a_summary_of_venues_says_what_rings_and_how_the_last_calibration_ended(service, name):
    service.http.put(f"/venues/{name}", json=venue(name, "fail") | {"alarms": {"rejected_in_a_row": 1}})
    before = listed(service, "/venues", q=name, fields="summary")
    assert before["venues"] == []
    assert before["summaries"] == [
        {"id": name, "name": "fail", "cameras": ["left", "right"], "scheduled": False}
        | {"state": "ok", "alarms": [], "last": None}
    ]
    service.end(service.submit(name).json()["id"])
    (one,) = listed(service, "/venues", q=name, fields="summary")["summaries"]
    assert (one["state"], one["last"]["status"], one["last"]["verdict"]) == ("alarm", "failed", None)
    assert [alarm["rule"] for alarm in one["alarms"]] == ["rejected-in-a-row"] * len(one["alarms"])


@in_both_homes
def test_venues_are_found_by_a_part_of_their_id_or_name_and_by_what_rings(service, name):
    rules = {"alarms": {"rejected_in_a_row": 1}}
    for venue_id, behaviour in ((f"{name}-a", "fail"), (f"{name}-b", "accept 0.01")):
        service.http.put(f"/venues/{venue_id}", json=venue(venue_id, behaviour) | rules)
    service.end(service.submit(f"{name}-a").json()["id"])
    assert ids(listed(service, "/venues", q=name.upper())) == [f"{name}-a", f"{name}-b"]
    assert f"{name}-b" in ids(listed(service, "/venues", q="CEPT 0.0", limit=1000))
    assert ids(listed(service, "/venues", q=name, state="alarm")) == [f"{name}-a"]
    assert ids(listed(service, "/venues", q=name, state="ok")) == [f"{name}-b"]
    page = service.http.get("/venues", params={"q": name, "limit": 1})
    assert ids(service.http.get(page.url.join(page.links["next"]["url"])).json()) == [f"{name}-b"]
    assert ids(listed(service, "/venues", q=f"{name}%")) == []


@pytest.mark.parametrize(
    ("path", "chosen"),
    [
        ("/venues", {"q": ""}),
        ("/venues", {"q": "a\0"}),
        ("/venues", {"state": "well"}),
        ("/venues", {"fields": "few"}),
        ("/jobs", {"fields": "few"}),
    ],
)
def test_what_a_list_cannot_be_asked_is_refused(service, path, chosen):
    assert service.http.get(path, params=chosen).status_code == 422
