"""The service in the process of the tests, one per home, whose venues tests tell apart by their names."""

import pytest

from service.settings import Settings
from testbed.homes import Embedded
from tests.service.local_service import LocalService


@pytest.fixture(scope="package")
def service_of_a_folder(tmp_path_factory):
    yield from local_service(Embedded(), tmp_path_factory.mktemp("local"))


@pytest.fixture(scope="package")
def service_on_servers(servers, tmp_path_factory):
    yield from local_service(servers, tmp_path_factory.mktemp("local"))


def local_service(home, folder):
    home.make_database(folder)
    settings = Settings(data=folder, sources=["127.0.0.0/8", "localhost"], **home.settings(folder))
    with LocalService(settings) as service:
        yield service
