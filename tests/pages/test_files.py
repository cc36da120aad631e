"""Static files, and the policy that every page comes with: looked at without a browser."""

import re

import pytest

from service.pages.assets import FILES, address, contents


def test_files_are_kept_for_a_year_under_an_address_that_changes_with_them(stub):
    answer = stub.http.get(address("page.css"))
    assert answer.headers["Content-Type"].startswith("text/css")
    assert answer.headers["Cache-Control"] == "public, max-age=31536000, immutable"
    again = stub.http.get(address("page.css"), headers={"If-None-Match": answer.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_a_page_from_before_an_update_gets_todays_files_and_keeps_none(stub):
    answer = stub.http.get("/ui/static/0123456789abcdef/page.js")
    assert answer.content == contents()["page.js"]
    assert answer.headers["Cache-Control"] == "no-cache"


@pytest.mark.parametrize("path", ["nothing.js", "../templates/base.html", "..%2f..%2fapp.py"])
def test_nothing_else_is_handed_out(stub, path):
    assert stub.http.get(f"/ui/static/0123456789abcdef/{path}").status_code == 404


def test_what_others_wrote_comes_with_its_licence():
    vendored = list((FILES / "vendor").iterdir())
    assert {path.name for path in vendored} == {"img-comparison-slider", "uplot"}
    assert all("MIT" in (path / "LICENSE.txt").read_text() for path in vendored)


@pytest.mark.parametrize("path", ["/", "/ui/jobs", "/ui/new-venue", "/ui/venues/nowhere"])
def test_pages_have_a_policy_and_nothing_inline(stub, path):
    answer = stub.http.get(path)
    policy = answer.headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'self';")
    assert "unsafe" not in policy
    assert not re.search(r"<script(?![^>]*\bsrc=)|<style|\sstyle=|\son\w+=|https?://", answer.text)
