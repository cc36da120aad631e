import shutil

import pytest

from worker.job_files import FileUnavailableError, JobFiles


def test_frames_that_the_store_does_not_hand_out_fail_the_job_in_its_words(stock, tmp_path):
    task = stock.attempts.begin(stock.submitted("v"))
    files = JobFiles(stock.settings)
    assert files.frames(task) == {"left": [b"frame"]}
    shutil.rmtree(tmp_path / "blobs/frames")
    with pytest.raises(FileUnavailableError, match=r"The stored frame frames/.*/left/0 is gone") as gone:
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
