"""One browser for all, and services: one with the real engine, one whose venues' names say what happens."""

import json
import shutil
import sys
from contextlib import ExitStack
from functools import cache

import pytest

from service.settings import MODEL_BESIDE_THE_CODE
from testbed.running import Service, ready, wait_for
from testbed.stock import Stock
from tests.once import made_once
from tests.pages import newcomer
from tests.pages.browsing import browser_at, chromium, person, tab

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
    """A service whose engine does what the names of the venues say, and which may fetch frames from this machine.

    Fixtures that put something into it live as long as it does: tests are shared out as processes become free, so that
    a module may begin twice on one service.
    """
    running = Service(tmp_path_factory.mktemp("stub"), ESC_SOURCES='["127.0.0.0/8"]')
    wait_for(lambda: ready(running.http), STARTING_S)
    yield running
    assert running.stop() == 0


@pytest.fixture(scope="package")
def stored(stub):
    """The database of that service, for calibrations that need no job to have run."""
    stock = Stock(stub.data)
    yield stock
    stock.engine.dispose()


@pytest.fixture(scope="package")
def real(browser, tmp_path_factory):
    """The address of a service with the real engine, after a newcomer went the whole way on its page."""

    def started(data):
        program = json.dumps([sys.executable, "-m", "worker.jobs.program"])
        return Service(data, ESC_JOB_PROGRAM=program, ESC_MODEL=str(MODEL_BESIDE_THE_CODE)).ready()

    def go(data):
        running = started(data)
        with person(browser, running.url) as somebody, tab(somebody) as page:
            newcomer.goes_the_whole_way(page)
        assert running.stop() == 0

    data = shutil.copytree(made_once(tmp_path_factory, "newcomer", go), tmp_path_factory.mktemp("real") / "data")
    running = started(data)
    yield running.url
    assert running.stop() == 0


@pytest.fixture(scope="package")
def people(browser):
    """Somebody for each way to look at a service, who has it open: that costs more than to look at a page of it."""
    with ExitStack() as known:

        @cache
        def whoever(url, **how):
            return known.enter_context(person(browser, url, **how))

        yield whoever


@pytest.fixture
def visit(people):
    """Opens a page of a service for somebody who is not signed in; what its console says is looked at in the end."""
    with ExitStack() as opened:

        def visit(url, path="/", forgiven=(), **how):
            somebody = people(url, **how)
            opened.callback(somebody.clear_cookies)
            page = opened.enter_context(tab(somebody, forgiven))
            page.goto(path)
            return page

        yield visit
