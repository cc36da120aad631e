"""Stands in for the program that computes a job: does what the name of the venue says, and no geometry."""

import os
import signal
import sys
import time

from service import lifeline
from service.settings import Settings
from service.store.blobs import Blobs
from service.store.engine import connect
from service.store.jobs import Jobs, picture_folder
from service.wire.geometry import Moved, Pose
from service.wire.job import JobError, Progress
from service.wire.results import CameraResult, FieldResult, MeasureResult, Provenance, Result
from worker.message import Message

JPEG = b"\xff\xd8\xff\xd9"
SHIFT_M = 0.125
MEASURES = [
    MeasureResult(name="length_m", given=105, value=104.25, sigma=0.05, open=5, known=True, detail=""),
    MeasureResult(name="width_m", given=68, value=67, sigma=5, open=5, known=False, detail="no line is in view"),
]


def say(**message):
    print(Message(**message).line(), flush=True)


def main(job_id: str, run_token: str) -> None:
    lifeline.end_with_parent()
    settings = Settings()
    task = Jobs(connect(settings.home_database_url)).task(job_id, run_token)
    behaviour, _, seconds = task.venue.name.partition(" ")
    with (settings.data / "begun").open("a") as begun:
        begun.write(f"{job_id} {os.getpid()}\n")
    say(progress=Progress(stage="segmentation", fraction=0.1))
    end = time.monotonic() + float(seconds or 0)
    while time.monotonic() < end:
        time.sleep(0.05)
        say(progress=Progress(stage="evolution", fraction=0.5, generation=7, loss=0.3))
    match behaviour:
        case "hang":
            time.sleep(3600)
        case "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "kill-worker":
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(3600)
        case "chatter":
            print("this is not a message", flush=True)
        case "fail":
            say(error=JobError(type="/problems/no-markings-in-view", title="", detail="It is black.", camera="left"))
            return
    if task.kind not in ("calibration", "field"):
        say(error=JobError(type="/problems/no-pose", title="", detail="This program only moves cameras."))
        return
    blobs = Blobs(settings.home_blob_url)
    pictures = ["preview", "birdseye", *(f"overlay_{camera.id}" for camera in task.venue.cameras)]
    if behaviour == "reject":
        pictures.remove("preview")
    for name in pictures:
        blobs.put(f"{picture_folder(job_id, run_token)}/{name}.jpg", JPEG)
    cameras = [
        CameraResult(
            id=camera.id,
            pose=Pose.at(camera.pose.rotation, [camera.pose.position[0] + SHIFT_M, *camera.pose.position[1:]]),
            sigma=None,
            moved=Moved(rotation_deg=0, position_m=SHIFT_M, pixels=1.0),
            iou=0.9,
            residual_px=1.0,
        )
        for camera in task.venue.cameras
    ]
    common = {
        "accepted": behaviour != "reject",
        "rejected_because": "the lines do not fit" if behaviour == "reject" else None,
        "cameras": cameras,
        "stitch_error_px": 0.2,
        "timings_s": {"decode": 0.1},
        "provenance": Provenance(
            software="0", model_sha256="0", seed=task.options.seed, options=task.options.model_dump()
        ),
    }
    if task.kind == "field":
        field = task.venue.field.model_copy(update={"length_m": 104.25})
        say(result=FieldResult(field=field, measures=MEASURES, **common), pictures=pictures[2:])
    else:
        say(result=Result(stitch_error_before_px=10.0, loss=0.1, generations=10, **common), pictures=pictures)


if __name__ == "__main__":
    main(*sys.argv[1:])
