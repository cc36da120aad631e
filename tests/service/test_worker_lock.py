"""One worker of a name on a folder, and none that is kept out by one that is about to end."""

import threading
from contextlib import closing

import pytest

from service.settings import Settings
from service.worker_lock import AlreadyRunning, lock_worker


def test_a_worker_waits_for_one_that_is_about_to_end(tmp_path):
    settings = Settings(data=tmp_path, worker_name="truck")
    before = lock_worker(settings)
    threading.Timer(0.3, before.close).start()
    with closing(lock_worker(settings)):
        assert before.closed


def test_a_worker_whose_name_another_one_keeps_is_refused_with_what_to_do(tmp_path):
    settings = Settings(data=tmp_path, worker_name="truck")
    with closing(lock_worker(settings)), pytest.raises(AlreadyRunning, match="another name"):
        lock_worker(settings)


def test_workers_of_two_names_run_on_one_folder(tmp_path):
    with (
        closing(lock_worker(Settings(data=tmp_path, worker_name="truck"))),
        closing(lock_worker(Settings(data=tmp_path, worker_name="pole"))),
    ):
        pass
