"""Frames that are fetched from sources."""

import json
import sys

import pytest

from service.intake.snapshots import Snapshots
from service.schemas.problems import Problem
from service.schemas.venue import VenueIn
from service.settings import Settings
from testbed.running import venue


def test_the_program_that_fetches_frames_sees_no_secret_of_the_service(monkeypatch, tmp_path):
    seen = tmp_path / "seen"
    writing = f"import json, os; open({str(seen)!r}, 'w').write(json.dumps(dict(os.environ)))"
    secrets = ("ESC_DATABASE_URL", "ESC_WEBHOOK_SECRET", "AWS_SECRET_ACCESS_KEY", "PGPASSWORD")
    settings = Settings(source_program=[sys.executable, "-c", writing])
    for name in secrets:
        monkeypatch.setenv(name, "x")
    (camera, _) = VenueIn.model_validate(venue("v")).to_venue().cameras
    with pytest.raises(Problem, match="No frame of camera left"):
        Snapshots(settings, lambda _: None).take(camera.model_copy(update={"source": "http://127.0.0.1/x"}), {})
    inherited = json.loads(seen.read_text())
    assert {"PATH", "OMP_NUM_THREADS"} <= inherited.keys()
    assert not inherited.keys() & set(secrets)


def test_why_a_camera_gave_no_frame_is_told_without_its_password(tmp_path):
    answer = {"camera": "left", "why": "rtsp://user:secret@10.1.0.7/live?pwd=hidden: no route to host", "seconds": 0.1}
    settings = Settings(source_program=[sys.executable, "-c", f"print({json.dumps(json.dumps(answer))})"])
    (camera, _) = VenueIn.model_validate(venue("v")).to_venue().cameras
    seen = camera.model_copy(update={"source": "rtsp://***@10.1.0.7/live?pwd=***"})
    with pytest.raises(Problem, match="no route to host") as problem:
        Snapshots(settings, lambda _: None).take(seen, {"left": "user:secret?pwd=hidden"})
    assert "secret" not in problem.value.detail
    assert "hidden" not in problem.value.detail
