"""One browser for all, and services: one with the real engine, one whose venues' names say what happens."""

import shutil

import pytest

from tests.demo.__main__ import service
from tests.e2e.running import Service, wait_for
from tests.once import made_once
from tests.pages import newcomer
from tests.pages.browsing import browser_at, chromium, tab

# Worker and engine load libraries first.
STARTING_S = 120


@pytest.fixture(scope="package")
def browser(missing):
    # Not for the session: Playwright's loop keeps other tests from running one of their own.
    path = chromium()
    if path is None:
        missing("browser")
    with browser_at(path) as running:
        yield running


@pytest.fixture(scope="package")
def stub(tmp_path_factory):
    """A service whose engine does what the names of the venues say."""
    running = Service(tmp_path_factory.mktemp("stub"))
    wait_for(lambda: running.http.get("/readyz").status_code == 200, STARTING_S)
    yield running
    assert running.stop() == 0


@pytest.fixture(scope="package")
def real(browser, tmp_path_factory):
    """The address of a service with the real engine, after a newcomer went the whole way on its page."""

    def go(data):
        with service(data) as url, tab(browser, url) as page:
            newcomer.goes_the_whole_way(page)

    data = shutil.copytree(made_once(tmp_path_factory, "newcomer", go), tmp_path_factory.mktemp("real") / "data")
    with service(data) as url:
        yield url


@pytest.fixture
def visit(browser):
    """Opens a page of a service; what its console says is looked at in the end."""
    opened = []

    def visit(url, path="/", **how):
        one = tab(browser, url, **how)
        page = one.__enter__()
        opened.append(one)
        page.goto(path)
        return page

    yield visit
    for one in opened:
        one.__exit__(None, None, None)
