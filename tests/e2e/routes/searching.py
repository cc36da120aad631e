"""Requests that find cameras, and venues of which nothing is known."""

import json
from datetime import UTC, datetime

import sqlalchemy as sa

from service.store import tables
from testbed.running import upload


def site(name, behaviour="accept", cameras=("left", "right"), **known):
    """A venue of which nothing is known but the sport and the names of its cameras."""
    places = [{"id": camera, **known.get(camera, {})} for camera in cameras]
    return {"id": name, "name": behaviour, "field": {"template": "football"}, "cameras": places}


def find(service, name, *, place=None, files=None, headers=None, **options):
    parts = upload() if files is None else files
    if place is not None:
        parts = [*parts, ("site", ("site.json", json.dumps(place)))]
    if options:
        parts = [*parts, ("options", (None, json.dumps(options)))]
    return service.http.post(f"/venues/{name}/find", files=parts, headers=headers)


def found(service, name, **asked):
    """A search at its end."""
    return service.end(find(service, name, **asked).raise_for_status().json()["id"])


def adopt(service, name, job, headers=None, **candidates):
    return service.http.post(
        f"/venues/{name}/adopt-found", json={"job": job["id"], "candidates": candidates}, headers=headers
    )


def depth(stored, camera):
    """How far in front of the pitch a camera stands, m: 40 is the first candidate, 60 the second, 50 none of them."""
    return -next(one for one in stored["cameras"] if one["id"] == camera)["pose"]["position"][1]


def forget_frames(service, job):
    """Let the frames of a job expire."""
    with service.database() as connection:
        gone = sa.update(tables.jobs).where(tables.jobs.c.id == job["id"]).values(frames_deleted_at=datetime.now(UTC))
        connection.execute(gone)
