"""Jobs of other kinds than calibrations have a page as well."""

from datetime import UTC, datetime

import pytest
import sqlalchemy as sa

from service.formats.conversion import members_of, write_cameras
from service.formats.records import CameraRecord
from service.schemas.options import Board, ClickedPoint, IntrinsicsOptions, LocateOptions
from service.schemas.results import CoverageResult, IntrinsicsResult, LocateResult, LocateSigma, PointResult
from service.schemas.venue import VenueIn
from service.store import tables
from service.store.ids import new_id
from testbed.running import upload, venue

CAMERA = VenueIn.model_validate(venue("kinds")).to_venue().cameras[0]
POINT = PointResult(world="centre spot", residual_px=1.5, doubted=False, exchanged_with=None, looks_like=None)
KNOWN = CAMERA.intrinsics.model_copy(update={"sigma": {"fx": 2.345, "k1": 0.0123}})
LENS = {"intrinsics": KNOWN, "image_size": CAMERA.image_size, "timings_s": {"fit": 0.3}, "software": "0"}
RESULTS = {
    "locate": LocateResult(
        accepted=True,
        rejected_because=None,
        camera="left",
        pose=CAMERA.pose,
        rms_px=1.25,
        sigma=LocateSigma(rotation_deg=0.1, position_m=0.2, pixels=3),
        points=[POINT],
        lens=None,
        warnings=["Click more points on the far side."],
        **LENS,
    ),
    "intrinsics": IntrinsicsResult(
        terms=["k1"],
        rms_px=1.25,
        left_out_px=0.4,
        sigma={},
        spread={},
        coverage=CoverageResult(share=0.8, empty=[]),
        photos=[],
        trials=[],
        warnings=["Click more points on the far side."],
        **LENS,
    ),
}
OPTIONS = {
    "locate": LocateOptions(points=[ClickedPoint(world="centre spot", pixel=[1, 2])] * 4),
    "intrinsics": IntrinsicsOptions(board=Board(columns=9, rows=6, square_m=0.03)),
}


@pytest.mark.parametrize("kind", RESULTS)
def test_a_lens_and_a_first_pose_are_shown_with_what_they_are_worth(stub, kind):
    job, now = new_id(), datetime.now(UTC)
    row = {
        "id": job,
        "kind": kind,
        "venue": "kinds" if kind == "locate" else None,
        "status": "succeeded",
        "priority": 100,
        "options": OPTIONS[kind].model_dump(mode="json"),
        "content_hash": job,
        "venue_document": None,
        "frames": {},
        "attempt": 1,
        "result": RESULTS[kind].model_dump(mode="json"),
        "created_at": now,
        "started_at": now,
        "finished_at": now,
        "updated_at": now,
    }
    with stub.database() as connection:
        connection.execute(sa.insert(tables.jobs).values(**row))
    shown = stub.http.get(f"/ui/jobs/{job}").raise_for_status().text
    assert "1.25 px" in shown
    assert "Click more points on the far side." in shown
    assert "fx ± 2.3" in shown
    assert kind in stub.http.get(f"/ui/jobs?kind={kind}").raise_for_status().text


def test_a_check_shows_the_grade_of_each_camera_and_why(stub):
    cameras = [CameraRecord(camera, CAMERA.intrinsics, (64, 48), CAMERA.pose) for camera in ("left", "right")]
    files = members_of(write_cameras(cameras, "pose2sim"), "left")
    parts = [("calibration", file) for file in files.items()]
    options = ("options", (None, '{"field": {"template": "tennis"}}'))
    job = stub.end(stub.http.post("/check", files=[*parts, *upload(), options]).raise_for_status().json()["id"])
    shown = stub.http.get(f"/ui/jobs/{job['id']}").raise_for_status().text
    for words in ("Check of a calibration", "read as pose2sim", "Good", "Drifted", "turned by 0.6 degrees", "0.70 m"):
        assert words in shown
