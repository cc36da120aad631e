"""Stands in for the program that computes a job: does what the name of the venue says, and no geometry.

It reads and writes plain JSON: the models of the messages take a quarter of a second to import, for each job anew.
"""

import json
import math
import os
import signal
import sys
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

# Started without `site`, which would take as long as the program itself.
sys.path.append(str(Path(__file__).parents[1]))

from service import child_process
from service.schemas.rotation import rotate

JPEG = b"\xff\xd8\xff\xd9"
# Where cameras end, of the way from the middle of the pitch to where they were. Their translation shrinks alike.
NEARER = 0.875
# Rotation of cameras in venues of this name, rad about their first axis.
TURNED = 0.05
# From the anchor of each camera, as it is told after every job.
DISPLACEMENT = {
    "at": [-20, 34],
    "across_m": 0.03,
    "away_m": 0.04,
    "sigma_across_m": 0.01,
    "sigma_away_m": 0.02,
    "repeatability_across_m": 0.005,
    "repeatability_away_m": 0.01,
    "rotation_deg": 0.01,
    "position_m": 0.001,
    "focal_length": 0.0001,
    "sigma_focal_length": 0.0002,
    "focal_length_m": 60,
}
MEASURES = [
    {"name": "length_m", "given": 105, "value": 104.25, "sigma": 0.05, "open": 5, "known": True, "detail": ""},
    {"name": "width_m", "given": 68, "value": 67, "sigma": 5, "open": 5, "known": False, "detail": "no line seen"},
]


def say(**message) -> None:
    print(json.dumps(message), flush=True)


def failed(kind: str, detail: str, camera: str | None = None) -> dict:
    return {"error": {"type": f"/problems/{kind}", "title": "", "detail": detail, "camera": camera}}


def done(result: dict, pictures: list[str], memories: dict | None = None) -> dict:
    return {"result": result, "pictures": dict.fromkeys(pictures, len(JPEG)), "memories": memories or {}}


def main() -> None:
    child_process.end_with_parent()
    given = json.loads(sys.stdin.buffer.readline())
    task = given["task"]
    about = task["venue"] or task.get("site")
    behaviour, _, seconds = about["name"].partition(" ") if about else ("", "", "")
    with Path(given["means"]["model"]).with_name("begun").open("a") as begun:
        begun.write(f"{task['job_id']} {os.getpid()}\n")
    say(progress={"stage": "segmentation", "fraction": 0.1})
    # Other venues are called whatever their owners like.
    end = time.monotonic() + (float(seconds) if seconds.replace(".", "").isdigit() else 0)
    # A test that needs the program to run until something else has happened lets a file lie there so long.
    hold = Path(given["means"]["model"]).with_name(f"hold {about and about['id']}")
    while time.monotonic() < end or hold.exists():
        time.sleep(0.05)
        say(progress={"stage": "evolution", "fraction": 0.5, "generation": 7, "loss": 0.3})
    match behaviour:
        case "hang":
            if task["kind"] == "find":
                end = datetime.now(UTC) + timedelta(seconds=150)
                say(progress={"stage": "evolution", "fraction": 0.5, "expected_end": end.isoformat()})
            time.sleep(3600)
        case "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "kill-worker":
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(3600)
        case "chatter":
            print("this is not a message", flush=True)
    last = answer(task, list(given["sizes"]))
    say(**last)
    sys.stdout.buffer.write(JPEG * len(last.get("pictures", ())))
    sys.stdout.flush()


def answer(task: dict, with_frames: list[str]) -> dict:
    """The last message about a task, as the name of its venue says; its pictures are all alike."""
    about = task["venue"] or task.get("site")
    behaviour = about["name"].partition(" ")[0] if about else ""
    if behaviour == "fail":
        return failed("no-markings-in-view", "It is black.", "left")
    if task["kind"] == "find":
        sought = sought_cameras(task, with_frames)
        pictures = [f"candidate_{camera}_{number}" for camera in sought for number in (1, 2)]
        return done(found_cameras(sought, behaviour, task), pictures)
    if task["kind"] == "check":
        return done(checked(task["options"]), [])
    if task["kind"] not in ("calibration", "field"):
        return failed("no-pose", "This program only moves cameras.")
    cameras = task["venue"]["cameras"]
    memories = remembered(task, [camera["id"] for camera in cameras]) if behaviour == "refine" else {}
    pictures = ["preview", "birdseye", *(f"overlay_{camera['id']}" for camera in cameras)]
    if behaviour == "reject":
        pictures.remove("preview")
    good = {"reject": 0, "swapped": 0, "partly": 1, "knock": 1}.get(behaviour, len(cameras))
    everyone = good == len(cameras)
    common = {
        "kind": task["kind"],
        "accepted": everyone,
        "rejected_because": None if everyone else "the lines do not fit",
        "cameras": [
            found(
                camera,
                task.get("anchors", {}).get(camera["id"]),
                accepted=number < good,
                # No pose is sought in another camera's frame.
                nearer=1 if behaviour in ("swapped", "turn") else NEARER,
                turned=TURNED if behaviour == "turn" else 0,
            )
            | (refined(camera, memories) if behaviour == "refine" else {})
            | (knocked(camera) if behaviour == "knock" and number >= good else {})
            for number, camera in enumerate(cameras)
        ],
        "stitch_error_px": 0.2,
        "timings_s": {"decode": 0.1},
        "provenance": {
            "software": "0",
            "model_sha256": "0",
            "seed": task["options"]["seed"],
            "options": task["options"],
        },
    }
    if behaviour == "impossible":
        common["cameras"][0]["pose"] = pose_at([1.6, 0.1, -0.2], [5000.0, -50.0, 8.0])
    if task["kind"] == "field":
        field = task["venue"]["field"] | {"length_m": 104.25}
        return done(common | {"field": field, "measures": MEASURES}, pictures[2:])
    verdict = {
        "verdict": "accepted" if everyone else "partly" if good else "rejected",
        "stitch_error_before_px": 10.0,
        "loss": 0.1,
        "generations": 10,
    }
    more = contradicted(task["venue"]["field"]) if behaviour == "contradict" else {}
    return done(common | verdict | more, pictures, memories)


def sought_cameras(task: dict, with_frames: list[str]) -> list[str]:
    """The cameras that are to be found."""
    if task.get("site"):
        return [camera["id"] for camera in task["site"]["cameras"] if not camera.get("pose")]
    return task["options"]["cameras"] or with_frames


def found_cameras(sought: list[str], behaviour: str, task: dict) -> dict:
    """Two candidates of each camera, 40 and 60 m from the pitch; none or the first camera alone is accepted by name.

    The second one of an accepted camera is said to be its twin; of "hopeless" ones there are 13 candidates.
    """
    good = {"reject": 0, "hopeless": 0, "partly": 1}.get(behaviour, len(sought))
    away_m = [40.0 + 20 * number for number in range(13 if behaviour == "hopeless" else 2)]
    why = "two poses explain the frame alike"
    return {
        "kind": "find",
        "accepted": good == len(sought),
        "rejected_because": None if good == len(sought) else "; ".join(f"camera {one}: {why}" for one in sought[good:]),
        "cameras": [
            {
                "id": camera,
                "accepted": number < good,
                "reason": None if number < good else "not-unique",
                "rejected_because": None if number < good else why,
                "remarks": ["assumed: it stands on the near side"],
                "assumed_side": "near" if number < good else None,
                "image_size": [64, 48],
                "candidates": [candidate(away) for away in away_m],
            }
            for number, camera in enumerate(sought)
        ],
        "ridge": [[-18.5, 0.0, 0.25], [18.5, 0.0, 0.25]] if behaviour == "crowned" else None,
        "stitch_error_px": 0.4,
        "timings_s": {"evolution": 0.1},
        "provenance": {"software": "0", "model_sha256": "0", "seed": task["options"]["seed"], "options": {}},
    }


def checked(given: dict) -> dict:
    """Grades of the cameras of a file: of several, the first is good and the others are turned."""
    unknown = dict.fromkeys(("off_px", "sigma_px", "off_m", "sigma_m", "detail", "pose", "intrinsics"))
    known = {"image_size": [64, 48], **unknown}
    good = {"grade": "good", "causes": [], "off_px": 0.4, "sigma_px": 0.3}
    turned = {"grade": "drifted", "causes": [{"cause": "turned", "detail": "turned by 0.6 degrees"}], "off_m": 0.7}
    cameras = [known | {"id": one["id"]} | (turned if number else good) for number, one in enumerate(given["cameras"])]
    return {
        "kind": "check",
        "grade": cameras[-1]["grade"],
        "format": given["format"],
        "field": given["field"],
        "cameras": cameras,
        "timings_s": {"check": 0.1},
        "software": "0",
    }


def candidate(away_m: float) -> dict:
    """A camera that looks at the pitch from the near side, 8 m high; its translation is -R position."""
    return {
        "intrinsics": {"matrix": [[50, 0, 32], [0, 50, 24], [0, 0, 1]], "distortion": [], "sigma": {"fx": 0.5}},
        "pose": {"rotation": [math.pi / 2, 0, 0], "position": [0, -away_m, 8], "translation": [0, 8, away_m]},
        "agreement": 0.8,
        "lines_found": 0.9,
        "residual_px": 1.0,
        "sigma": {"rotation_deg": 0.35, "position_m": 0.17},
    }


def remembered(task: dict, cameras: list[str]) -> dict:
    """Memory of each camera: the number of its jobs, and when its frames of the last one were taken."""
    return {
        camera: {"jobs": task["memories"].get(camera, {"jobs": 0})["jobs"] + 1, "last": task["taken_at"]}
        for camera in cameras
    }


def knocked(camera: dict) -> dict:
    """A camera that was found elsewhere and is proposed there."""
    moved = {"rotation_deg": 11.2, "position_m": 0.3, "pixels": 400.0}
    pose = found(camera, None, accepted=False)["pose"]
    return {
        "knocked": True,
        "moved": moved,
        "proposed": {"pose": pose, "sigma": None, "moved": moved, "found": 0.97},
        "rejected_because": "turned by 11.2 degrees and moved by 0.30 m, and found again",
        "refusal": "/refusals/knocked",
    }


def refined(camera: dict, memories: dict) -> dict:
    """A focal length that is a tenth of a per cent longer, 2 cm above the answer, and what the memory says of it."""
    (fx, skew, cx), (_, fy, cy), last = camera["intrinsics"]["matrix"]
    pose = found(camera, None, accepted=True)["pose"]
    x, y, z = pose["position"]
    return {
        "refined": {
            "pose": pose_at(pose["rotation"], [x, y, z + 0.02]),
            "intrinsics": {
                "matrix": [[1.001 * fx, skew, cx], [0, 1.001 * fy, cy], last],
                "distortion": [0, 0, 0, 0],
                "sigma": {"fx": 0.01},
            },
            "covariance": None,
            "sigma": None,
            "longer": 0.001,
            "differs_m": 0.034,
        },
        "lens_change": {
            "longer": 0.006,
            "sigma": 0.001,
            "since": "2026-11-03T02:00:00Z",
            "words": "focal length 0.6 ± 0.1 % longer than on 3 November: zoom ring or focus",
        },
        "nights": memories[camera["id"]]["jobs"],
    }


def contradicted(field: dict) -> dict:
    """A ridge that is 0.332 m high, and a pitch that is longer than any law allows."""
    told = {"ridge_height_m": (0.0, 0.332, 0.051, "a ridge"), "length_m": (field["length_m"], 131.5, 0.2, "a length")}
    return {
        "diagnosis": [
            {
                "camera": None,
                "quantity": name,
                "deviation": value - given,
                "sigma": sigma,
                "detail": f"the lines fit {what}",
            }
            for name, (given, value, sigma, what) in told.items()
        ],
        "adoptable": [
            {"name": name, "given": given, "value": value, "sigma": sigma, "moves_m": {"left": 0.081, "right": 0.079}}
            for name, (given, value, sigma, _) in told.items()
        ],
    }


def found(camera: dict, anchor: dict | None, *, accepted: bool, nearer: float = NEARER, turned: float = 0) -> dict:
    pose = camera["pose"]
    first, *others = pose["rotation"]
    position = [nearer * component for component in pose["position"]]
    return {
        "id": camera["id"],
        "accepted": accepted,
        "rejected_because": None if accepted else "the lines do not fit",
        "pose": pose_at([first + turned, *others], position),
        "sigma": None,
        "moved": {"rotation_deg": 0, "position_m": 6.4, "pixels": 1.0},
        "iou": 0.9,
        "residual_px": 1.0,
        "displacement": DISPLACEMENT | {"anchor": anchor and anchor["revision"]},
    }


def pose_at(rotation: list[float], position: list[float]) -> dict:
    return {
        "rotation": rotation,
        "position": position,
        "translation": [-component for component in rotate(rotation, position)],
    }


if __name__ == "__main__":
    main()
