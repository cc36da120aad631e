import os
import shutil
import subprocess
import sys

from worker.message import Message


def test_frames_that_the_store_does_not_hand_out_fail_the_job_in_its_words(stock, tmp_path):
    task = stock.attempts.begin(stock.submitted("v"))
    shutil.rmtree(tmp_path / "blobs/frames")
    (tmp_path / "blobs/frames").write_bytes(b"no folder")
    program = [sys.executable, "-m", "worker.jobs.job"]
    environment = os.environ | {"ESC_DATA": str(tmp_path)}
    given = task.model_dump_json().encode()
    ended = subprocess.run(program, input=given, env=environment, capture_output=True, timeout=60)
    error = Message.model_validate_json(ended.stdout).error
    assert (error.type, error.camera) == ("/problems/job-crashed", "left")
    assert error.detail.startswith("A stored frame cannot be read: ")
    assert "Not a directory" in error.detail
