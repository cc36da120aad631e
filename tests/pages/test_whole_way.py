"""A new user, an empty service, two frames: the whole way, in a browser, with the real engine."""

import httpx
import numpy as np
from playwright.sync_api import expect

from tests.pages.newcomer import TRUTH


def poses(url):
    cameras = httpx.get(f"{url}/venues/newcomer").raise_for_status().json()["cameras"]
    return {camera["id"]: np.array(camera["pose"]["position"]) for camera in cameras}


def test_a_newcomer_comes_to_poses_that_are_right(real):
    for camera, position in poses(real).items():
        assert np.linalg.norm(position - TRUTH[camera].position) < 0.05


def test_what_was_accepted_is_rejected_by_hand_and_restored(real, visit):
    page = visit(real, "/ui/venues/newcomer")
    accepted = poses(real)
    page.get_by_role("button", name="Reject").click()
    expect(page.get_by_text("These poses no longer hold")).to_be_visible()
    assert any(np.linalg.norm(position - accepted[camera]) > 1e-4 for camera, position in poses(real).items())
    page.get_by_role("button", name="Restore revision 2").click()
    expect(page.get_by_text("restored from 2")).to_be_visible()
    assert all((position == accepted[camera]).all() for camera, position in poses(real).items())
