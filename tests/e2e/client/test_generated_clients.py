"""Clients that generators write from the OpenAPI document, at a running service and at one of a later version.

The generators, and what they write, live in an environment of their own: `make generators`.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from testbed.running import png, venue
from tests.e2e.later import later

pytestmark = pytest.mark.long

# What later versions may answer where this one has words of its own.
NEWER_WORDS = {"kind": "swarm", "status": "parked", "verdict": "hazy", "cause": "foreseen", "refusal": "/refusals/bent"}
# The generator reads only the media types that it knows.
CONFIG = """
content_type_overrides:
  image/jpeg: application/octet-stream
  image/png: application/octet-stream
  application/zip: application/octet-stream
"""
CODEGEN = [
    *("--input", "openapi.json", "--input-file-type", "openapi", "--output", "models.py", "--formatters", "builtin"),
    *("--output-model-type", "pydantic_v2.BaseModel", "--target-python-version", "3.11"),
]
SUBMIT = """
import sys
from io import BytesIO
from made import Client
from made.api.jobs import get_job, submit_calibration
from made.api.venues import export_venue_poses, get_venue, put_venue
from made.models import OptionsIn, ProblemDetails, Result, SubmitCalibrationBody, VenueIn
from made.types import File
import json

url, later, name = sys.argv[1:]
client = Client(base_url=url)
document = json.load(open("venue.json"))
put_venue.sync(name, client=client, body=VenueIn.from_dict(document))
body = SubmitCalibrationBody(options=OptionsIn(seed=7))
for side in ("left", "right"):
    body[side] = File(BytesIO(open("frame.png", "rb").read()), f"{side}.png", "image/png")
job = submit_calibration.sync(name, client=client, body=body)
ended = get_job.sync(job.id, client=client, wait=60.0)
assert ended.status == "succeeded" and isinstance(ended.result, Result), ended
assert ended.result.provenance.seed == 7
poses = {camera.id: camera.pose for camera in get_venue.sync(name, client=client).cameras}
assert poses["left"] == ended.result.cameras[0].pose
assert len(poses["left"].position) == 3
exported = json.loads(export_venue_poses.sync_detailed(name, client=client).content)
assert exported["cameras"][0]["pose"]["position"] == poses["left"].position
refused = get_job.sync("01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", client=client)
assert isinstance(refused, ProblemDetails) and refused.type_ == "/problems/job-not-found"

newer = get_job.sync(job.id, client=Client(base_url=later))
assert (newer.kind, newer.status, newer.result.kind) == ("swarm", "parked", "swarm")
assert newer.result["verdict"] == "hazy" and newer["added_later"]
print(job.id)
"""
READ = """
import sys
import httpx
from models import Job, ProblemDetails, Result, Revision, Venue, VenueHealth, VenueIn

url, later, name, job = sys.argv[1:]
ask = httpx.Client(base_url=url)
read = VenueIn.model_validate_json(open("venue.json").read())
ask.put(f"/venues/{name}", json=read.model_dump(mode="json", exclude_unset=True)).raise_for_status()
assert isinstance(Job.model_validate_json(ask.get(f"/jobs/{job}").content).result, Result)
assert ProblemDetails.model_validate_json(ask.get("/venues/none").content).status == 404

ask = httpx.Client(base_url=later)
newer = Job.model_validate_json(ask.get(f"/jobs/{job}").content)
assert (newer.kind, newer.status, newer.result.kind) == ("swarm", "parked", "swarm")
assert len(Venue.model_validate_json(ask.get(f"/venues/{name}").content).cameras[0].pose.position) == 3
VenueHealth.model_validate_json(ask.get(f"/venues/{name}/health").content)
revisions = ask.get(f"/venues/{name}/history").json()["revisions"]
assert {Revision.model_validate(one).cause for one in revisions} == {"foreseen"}
"""


@pytest.fixture
def generators(missing):
    """The folder of the generators' programs."""
    programs = Path(sys.prefix) / "generators" / "bin"
    if not (programs / "openapi-python-client").exists():
        missing("generators")
    return programs


def ran(folder, *command):
    done = subprocess.run([str(part) for part in command], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_generated_clients_submit_poll_and_read_poses_and_bear_what_later_versions_add(
    generators, service, tmp_path, name
):
    (tmp_path / "openapi.json").write_text(service.http.get("/openapi.json").text)
    (tmp_path / "config.yaml").write_text(CONFIG)
    (tmp_path / "frame.png").write_bytes(png())
    (tmp_path / "venue.json").write_text(json.dumps(venue(name)))
    (tmp_path / "submit.py").write_text(SUBMIT)
    (tmp_path / "read.py").write_text(READ)
    made = ["--path", "openapi.json", "--meta", "none", "--config", "config.yaml", "--output-path", "made"]
    said = ran(tmp_path, generators / "openapi-python-client", "generate", *made)
    assert [words for words in ("WARNING", "Unable to") if words in said] == [], said
    ran(tmp_path, generators / "datamodel-codegen", *CODEGEN)
    with later(service, NEWER_WORDS) as newer:
        addresses = [service.url, newer.url, name]
        job = ran(tmp_path, generators / "python", "submit.py", *addresses).strip()
        ran(tmp_path, generators / "python", "read.py", *addresses, job)
