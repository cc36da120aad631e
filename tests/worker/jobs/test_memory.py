"""A job program takes no more memory than it may, and says so where its frames need more."""

import resource
import subprocess
import sys
import tempfile

import cv2
import numpy as np
import pytest

from service import child_process
from service.settings import Settings
from service.store.jobs.task import Task
from worker.compute_resources import ComputeResources
from worker.protocol import JobRequest, Message

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="the limit is one of Linux")]

MOST_MB = 400


def test_frames_that_need_more_memory_than_a_job_may_take_end_it_in_words():
    """Eight frames of 25 million pixels of each of four cameras: less than 2 MB of files, 2.4 GB of pixels."""
    large = np.full((5000, 5000), 120, np.uint8)
    files = dict.fromkeys(("a", "b", "c", "d"), [cv2.imencode(".png", large)[1].tobytes()] * 8)
    site = {
        "id": "v",
        "field": {"length_m": 105, "width_m": 68},
        "cameras": [{"id": camera} for camera in files],
    }
    rest = {"job_id": "j", "run_token": "t", "venue": None, "frames": {}}
    task = Task.model_validate({"kind": "find", "options": {"seed": 1}, "site": site, **rest})
    settings = Settings(job_memory_mb=MOST_MB)
    with tempfile.TemporaryFile() as given:
        JobRequest.of(task, ComputeResources.of(settings), files).write(given, files)
        given.seek(0)
        ended = subprocess.run(
            [sys.executable, "-m", "worker.jobs.program"],
            stdin=given,
            capture_output=True,
            env=child_process.without_secrets() | settings.native_environment,
            check=True,
        )
    error = Message.model_validate_json(ended.stdout.splitlines()[-1]).error
    assert error is not None
    assert f"need more memory than the {MOST_MB} MB that one job may take (ESC_JOB_MEMORY_MB)" in error.detail
    # Beside what it writes, a process has libraries in memory, and others that this process waited for had their own.
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 < (MOST_MB + 900) * 1e6
