import shutil

import pytest

from service.store import blobs
from service.store.blobs import Blobs
from tests.listener import Parrot
from worker.job_files import FileUnavailableError, JobFiles


def test_frames_that_the_store_does_not_hand_out_fail_the_job_in_its_words(stock, tmp_path):
    task = stock.attempts.begin(stock.submitted("v"))
    files = JobFiles(stock.settings)
    assert files.frames(task) == {"left": [b"frame"]}
    shutil.rmtree(tmp_path / "blobs/frames")
    with pytest.raises(FileUnavailableError, match=r"The stored frame frames/.*/left/0\.[0-9a-f]{64} is gone") as gone:
        files.frames(task)
    assert gone.value.camera == "left"
    (tmp_path / "blobs/frames").write_bytes(b"no folder")
    with pytest.raises(FileUnavailableError, match=r"A stored frame cannot be read: .*Not a directory"):
        files.frames(task)


def test_pictures_that_the_store_does_not_take_fail_the_job_in_its_words(stock, tmp_path):
    task = stock.attempts.begin(stock.submitted("v"))
    (tmp_path / "blobs/pictures").write_bytes(b"no folder")
    with pytest.raises(FileUnavailableError, match=r"Its pictures cannot be stored: .*Not a directory"):
        JobFiles(stock.settings).keep(task, {"preview": b"picture"})


DAMAGE = {
    "empty": (b"", "it is empty"),
    "half": (b"fra", "its 3 bytes are not those that were stored"),
    "another": (b"other", "its 5 bytes are not those that were stored"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_frame_that_the_store_hands_out_otherwise_than_it_came_is_a_damaged_one(stock, monkeypatch, damage):
    monkeypatch.setattr(blobs, "AGAIN_S", (0.01,))
    task = stock.attempts.begin(stock.submitted("v"))
    ((path,),) = task.frames.values()
    content, why = DAMAGE[damage]
    stock.blobs.put(path, content)
    with pytest.raises(FileUnavailableError) as damaged:
        JobFiles(stock.settings).frames(task)
    assert str(damaged.value) == f"The stored frame of left was damaged in the store: {why}. Send it again."
    assert (damaged.value.kind, damaged.value.camera) == ("broken-image", "left")


def test_a_frame_that_the_network_damaged_once_is_read_again(stock, monkeypatch):
    monkeypatch.setattr(blobs, "AGAIN_S", (0.01,))
    task = stock.attempts.begin(stock.submitted("v"))
    answers, read = [b"fra"], Blobs.get
    monkeypatch.setattr(Blobs, "get", lambda self, path: answers.pop() if answers else read(self, path))
    assert JobFiles(stock.settings).frames(task) == {"left": [b"frame"]}


def test_what_the_server_of_a_bucket_says_is_not_told(stock, monkeypatch):
    task = stock.attempts.begin(stock.submitted("v"))
    with Parrot(b"HTTP/1.1 403 hunter2\r\nContent-Length: 7\r\n\r\nhunter2") as bucket:
        settings = {
            "ENDPOINT_URL": f"http://{bucket.host}",
            "ALLOW_HTTP": "true",
            "ACCESS_KEY_ID": "k",
            "SECRET_ACCESS_KEY": "s",
        }
        for name, value in settings.items():
            monkeypatch.setenv(f"AWS_{name}", value)
        with pytest.raises(FileUnavailableError) as refused:
            JobFiles(stock.settings.model_copy(update={"blob_url": "s3://bucket"})).frames(task)
    assert str(refused.value) == "A stored frame cannot be read: the bucket does not take the service's credentials"
