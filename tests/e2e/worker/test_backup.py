"""The commands of the operations page, run as they stand there, but for the places they name."""

import os
import re
import subprocess
import sys
from pathlib import Path

import obstore
import pytest
from obstore.store import from_url

from testbed.homes import on_servers, postgres_binaries

PAGE = (Path(__file__).parents[3] / "docker" / "README.md").read_text()


def commands(title):
    """The block of the page that begins with this comment."""
    (block,) = re.findall(rf"```sh\n# {re.escape(title)}[^\n]*\n(.*?)```", PAGE, re.DOTALL)
    return block


@pytest.fixture
def shell(tmp_path):
    """Run commands of the page on a service's folder."""
    (tmp_path / "backup").mkdir()
    path = os.pathsep.join([str(Path(sys.executable).parent), str(postgres_binaries() or ""), os.environ["PATH"]])

    def shell(block, data, **environment):
        block = block.replace("/var/lib/esc", str(data)).replace("/backup", str(tmp_path / "backup"))
        # There is no such user here.
        block = re.sub(r"^chown .*$", "", block, flags=re.MULTILINE)
        return subprocess.run(["sh", "-euc", block], check=True, env={"PATH": path} | environment)

    return shell


def state(service, venue_id, job_id):
    return (
        service.http.get(f"/venues/{venue_id}").json(),
        service.job(job_id),
        service.http.get(f"/jobs/{job_id}/preview.jpg").content,
    )


@pytest.mark.long
def test_what_was_backed_up_while_it_ran_is_there_after_the_restore(start, shell):
    service = start("up").ready()
    done = service.submitted(service.venue("v"))
    service.end(done)
    waiting = service.submitted(service.venue("open", "accept 3"))
    before = state(service, "v", done)
    shell(commands("backup: sqlite"), service.data)
    service.calibrated(service.venue("later"))
    assert service.stop() == 0
    shell(commands("restore: sqlite"), service.data)
    service.start()
    service.ready()
    assert state(service, "v", done) == before
    assert service.http.get("/venues/later").status_code == 404
    # What was open then is computed again.
    assert service.end(waiting)["status"] == "succeeded"
    assert service.calibrated("v", 1)["status"] == "succeeded"


@pytest.mark.long
@on_servers
def test_a_dump_and_a_copy_of_the_bucket_make_the_service_again_elsewhere(start, home, shell, tmp_path):
    service = start("up").ready()
    done = service.submitted(service.venue("v"))
    service.end(done)
    waiting = service.submitted(service.venue("open", "accept 3"))
    before = state(service, "v", done)
    shell(commands("backup: postgresql"), service.data, ESC_DATABASE_URL=service.database_url)
    assert service.stop() == 0
    elsewhere = tmp_path / "elsewhere"
    new = home.settings(elsewhere)
    copy(service.blob_url, new["blob_url"])
    shell(commands("restore: postgresql"), service.data, ESC_DATABASE_URL=new["database_url"])
    restored = start("up", ESC_DATABASE_URL=new["database_url"], ESC_BLOB_URL=new["blob_url"]).ready()
    assert state(restored, "v", done) == before
    assert restored.end(waiting)["status"] == "succeeded"
    assert restored.calibrated("v", 1)["status"] == "succeeded"


def copy(source, target):
    """What `aws s3 sync` does."""
    here, there = from_url(source), from_url(target)
    for page in obstore.list(here):
        for entry in page:
            obstore.put(there, entry["path"], obstore.get(here, entry["path"]).bytes())
