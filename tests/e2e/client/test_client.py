"""The Python client, both ways, against a real service."""

import asyncio
import inspect

import httpx
import pytest

from service.client import AsyncClient, Client, Refused
from service.wire.venue import VenueIn
from tests.e2e.running import png, venue, wait_for


@pytest.fixture
def frames(tmp_path):
    files = {side: [tmp_path / f"{side}.png"] for side in ("left", "right")}
    for (file,) in files.values():
        file.write_bytes(png())
    return files


def test_a_year_in_the_life_of_a_venue_by_blocking_calls(service, frames, name):
    shown = []
    with Client(service.url) as client:
        client.put_venue(VenueIn.model_validate(venue(name, "reject 0.5")))
        job = client.follow(client.calibrate(name, frames, {"seed": 1}), shown.append)
        assert (job.status, shown[0].open) == ("succeeded", True)
        assert client.picture(job, "birdseye").startswith(b"\xff\xd8")
        assert client.picture(job, "preview") is None
        assert client.accept(job.id).venue_revision == 2
        assert [revision.cause for revision in client.history(name)] == ["accepted", "put"]
        assert len(client.history(name, 1)) == 1
        assert client.restore(name, 1).cameras[0].pose.position[0] == -1.0
        assert client.venue_health(name).revision == 3
        assert client.job_poses(job.id, "json").startswith(b"{")
        assert name in [one.id for one in client.venues()]
        client.delete_venue(name)
        with pytest.raises(Refused, match="There is no such venue") as refused:
            client.venue(name)
    assert (refused.value.status, refused.value.busy) == (404, False)


def test_the_same_without_blocking(service, frames, name):
    async def life():
        async with AsyncClient(service.url) as client:
            await client.put_venue(VenueIn.model_validate(venue(name, "accept 0.5")))
            submitted = await client.calibrate(name, {side: file for side, (file,) in frames.items()}, {"seed": 1})
            shown = []
            job, there = await asyncio.gather(client.follow(submitted, shown.append), client.venue(name))
            assert (job.status, there.id, shown[0].open) == ("succeeded", name, True)
            with pytest.raises(Refused, match="There is no such venue"):
                await client.venue("nowhere")
            return await client.history(name)

    assert [revision.cause for revision in asyncio.run(life())] == ["calibrated", "put"]


def test_both_clients_have_the_same_methods_with_the_same_signatures():
    clients = Client("http://127.0.0.1:9"), AsyncClient("http://127.0.0.1:9")
    names = [name for name in dir(Client) if not name.startswith("_") and name != "url_of"]
    assert len(names) == 23
    for name in names:
        blocking, awaited = (getattr(client, name) for client in clients)
        assert inspect.signature(blocking) == inspect.signature(awaited)
        assert blocking.__doc__


def test_who_follows_a_job_outlives_a_restart_of_the_service(start, frames):
    service = start().ready()
    port = httpx.URL(service.url).port
    restarted = []

    def restart(job):
        if not restarted:
            service.kill()
            service.start(port)
            restarted.append(job.id)

    with Client(service.url) as client:
        client.put_venue(VenueIn.model_validate(venue("v", "accept 1")))
        job = client.follow(client.calibrate("v", frames, {}), restart)
    assert (job.status, restarted) == ("succeeded", [job.id])
    wait_for(lambda: service.http.get("/livez").status_code == 200)
