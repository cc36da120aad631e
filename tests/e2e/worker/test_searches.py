"""Searches for cameras, which take minutes, run beside calibrations and hold none of them up."""

from tests.e2e.routes.searching import find, found, site


def test_a_calibration_that_is_submitted_during_a_search_ends_before_it(service, name):
    search = find(service, name, place=site(name, "hang")).json()["id"]
    service.running(search)
    waiting = find(service, f"{name}-2", place=site(f"{name}-2")).json()["id"]
    assert service.calibrated(service.venue(f"{name}-3"))["status"] == "succeeded"
    assert service.job(search)["status"] == "running"
    # Searches wait for each other alone.
    assert service.job(waiting)["queue_position"] == 1
    service.http.post(f"/jobs/{search}/cancel")
    assert service.end(waiting)["status"] == "succeeded"


def test_a_search_begins_while_calibrations_wait(service, name):
    busy = service.submitted(service.venue(f"{name}-a", "hang"))
    service.running(busy)
    service.submitted(service.venue(f"{name}-b"))
    assert found(service, name, place=site(name))["status"] == "succeeded"
    service.http.post(f"/jobs/{busy}/cancel")
