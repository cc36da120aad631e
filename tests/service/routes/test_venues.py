import json

import pytest

from testbed.running import venue
from tests.problems import problem_of

MEASURED = {"length_m": 0.03, "width_m": 0.02}


def test_a_new_venue_is_created_and_an_old_one_replaced(service, name):
    first = service.http.put(f"/venues/{name}", json=venue(name))
    assert first.status_code == 201
    second = service.http.put(f"/venues/{name}", json=venue(name, "other"))
    assert second.status_code == 200
    assert second.headers["etag"] != first.headers["etag"]
    stored = service.http.get(f"/venues/{name}")
    assert (stored.json()["name"], stored.headers["etag"]) == ("other", second.headers["etag"])


def test_what_get_gives_put_takes_and_nothing_changes(service, name):
    service.venue(name)
    read = service.http.get(f"/venues/{name}")
    again = service.http.put(f"/venues/{name}", json=read.json(), headers={"If-Match": read.headers["etag"]})
    assert (again.status_code, again.headers["etag"], kept(again)) == (200, read.headers["etag"], read.json())
    assert set(read.json()["cameras"][0]["pose"]) == {"rotation", "position", "translation"}
    # So does what answers a PUT, although it says more.
    once_more = service.http.put(f"/venues/{name}", json=again.json())
    assert (once_more.status_code, once_more.json()) == (200, again.json())
    assert len(service.http.get(f"/venues/{name}/history").json()["revisions"]) == 1


def kept(answer):
    """Venue that a PUT or PATCH has stored, without its warnings."""
    return {part: value for part, value in answer.json().items() if part != "warnings"}


def test_a_lens_of_which_nobody_says_how_well_it_is_known_is_said_to_be_taken_for_well_known(service, name):
    document = venue(name)
    document["field"]["sigma"] = MEASURED
    document["cameras"][0]["intrinsics"]["sigma"] = {"fx": 0.5}
    (warning,) = service.http.put(f"/venues/{name}", json=document).json()["warnings"]
    assert warning == (
        "camera right: its lens has no sigma and is taken to be as sure as a good board leaves it, 0.03 % of the focal "
        "length"
    )
    known = {"cameras": {"right": {"intrinsics": {"sigma": {"fx": 0.5}}}}}
    assert patched(service, name, known).json()["warnings"] == []
    assert "warnings" not in service.http.get(f"/venues/{name}").json()


def test_a_field_of_the_usual_size_that_nobody_vouches_for_is_said_to_be_a_guess(service, name):
    document = venue(name, cameras=("left",))
    document["cameras"][0]["intrinsics"]["sigma"] = {"fx": 0.5}
    (warning,) = service.http.put(f"/venues/{name}", json=document).json()["warnings"]
    assert warning == (
        "field: length_m 105 and width_m 68, as is usual for football, are taken to be as good as their digits, which "
        "poses are then no better than: if somebody has measured this one, say how well by sigma "
        '{"length_m": 0.05, "width_m": 0.05}'
    )
    (of_width,) = patched(service, name, {"field": {"length_m": 104.2}}).json()["warnings"]
    assert of_width.startswith("field: width_m 68, as")
    assert patched(service, name, {"field": {"sigma": {"width_m": 1}}}).json()["warnings"] == []


def test_a_pose_in_another_convention_is_named_by_put_and_by_patch(service, name):
    document = venue(name, cameras=("left",))
    document["field"]["sigma"] = MEASURED
    document["cameras"][0]["intrinsics"]["sigma"] = {"fx": 0.5}
    assert service.http.put(f"/venues/{name}", json=document).json()["warnings"] == []
    pose = document["cameras"][0]["pose"]
    pose["rotation"] = [-component for component in pose["rotation"]]
    put = service.http.put(f"/venues/{name}", json=document)
    (warning,) = put.json()["warnings"]
    assert (put.status_code, warning.startswith("camera left: its pose sees 0 m of markings")) == (200, True)
    assert "its rotation goes from camera to world" in warning
    assert patched(service, name, {"name": "other"}).json()["warnings"] == [warning]


def test_a_conditional_put_of_an_outdated_venue_is_refused(service, name):
    old, new = (service.http.put(f"/venues/{name}", json=venue(name, b)).headers["etag"] for b in ("accept", "other"))
    answer = service.http.put(f"/venues/{name}", json=venue(name), headers={"If-Match": old})
    assert problem_of(answer) == (412, "venue-changed")
    assert (answer.json()["expected"], answer.json()["got"]) == (old, new)
    assert service.http.put(f"/venues/{name}", json=venue(name), headers={"If-Match": new}).status_code == 200
    assert service.http.put(f"/venues/{name}", json=venue(name), headers={"If-None-Match": "*"}).status_code == 412


def patched(service, name, patch, **headers):
    sent = {"Content-Type": "application/merge-patch+json"} | headers
    return service.http.patch(f"/venues/{name}", content=json.dumps(patch), headers=sent)


def test_a_patch_changes_what_it_names_and_leaves_the_poses_that_were_calibrated(service, name):
    service.calibrated(service.venue(name))
    before = service.http.get(f"/venues/{name}").json()
    answer = patched(service, name, {"name": "Main pitch", "alarms": {"rejected_in_a_row": 3}})
    after = service.http.get(f"/venues/{name}")
    assert (answer.status_code, answer.headers["etag"], kept(answer)) == (200, after.headers["etag"], after.json())
    assert after.json()["alarms"]["rejected_in_a_row"] == 3
    assert after.json() | {"name": "accept", "alarms": None} == before
    patched(service, name, {"alarms": {"not_calibrated_for_h": 24}})
    assert (
        patched(service, name, {"alarms": {"rejected_in_a_row": None}}).json()["alarms"]["not_calibrated_for_h"] == 24
    )
    assert kept(patched(service, name, {"alarms": None})) == before | {"name": "Main pitch"}
    assert len(service.http.get(f"/venues/{name}/history").json()["revisions"]) == 2


def test_how_well_a_lens_is_known_is_put_read_and_patched_and_moves_nothing(service, name):
    document = venue(name)
    document["cameras"][0]["intrinsics"]["sigma"] = {"fx": 0.5, "k1": 0.01}

    def known(answer):
        return [camera["intrinsics"]["sigma"] for camera in answer.json()["cameras"]]

    put, read = service.http.put(f"/venues/{name}", json=document), service.http.get(f"/venues/{name}")
    assert known(put) == known(read) == [{"fx": 0.5, "k1": 0.01}, None]
    better = patched(service, name, {"cameras": {"left": {"intrinsics": {"sigma": {"fx": 0.1, "k1": None}}}}})
    assert known(better) == [{"fx": 0.1}, None]
    assert known(patched(service, name, {"cameras": {"left": {"intrinsics": {"sigma": None}}}})) == [None, None]
    wrong = patched(service, name, {"cameras": {"left": {"intrinsics": {"sigma": {"f": 1.0}}}}})
    assert (wrong.status_code, "it takes fx, fy, aspect" in wrong.text) == (422, True)
    assert len(service.http.get(f"/venues/{name}/history").json()["revisions"]) == 1


def test_cameras_are_patched_by_their_ids(service, name):
    service.venue(name)
    left, right = patched(service, name, {"cameras": {"left": {"source": "http://127.0.0.1/x"}}}).json()["cameras"]
    assert (left["source"], right["source"]) == ("http://127.0.0.1/x", None)
    moved = patched(service, name, {"cameras": {"right": {"pose": {"position": [1, -50, 8]}}}}).json()["cameras"]
    assert moved == [left, right | {"pose": moved[1]["pose"]}]
    assert moved[1]["pose"]["position"] == [1, -50, 8]
    assert service.http.get(f"/venues/{name}/history").json()["revisions"][0]["cause"] == "put"
    assert [one["id"] for one in patched(service, name, {"cameras": {"left": None}}).json()["cameras"]] == ["right"]


def test_a_conditional_patch_of_an_outdated_venue_is_refused(service, name):
    old = service.http.put(f"/venues/{name}", json=venue(name)).headers["etag"]
    new = patched(service, name, {"name": "a"}, **{"If-Match": old}).headers["etag"]
    answer = patched(service, name, {"name": "b"}, **{"If-Match": old})
    assert problem_of(answer) == (412, "venue-changed")
    assert patched(service, name, {"name": "b"}, **{"If-Match": new}).status_code == 200


@pytest.mark.parametrize(
    ("patch", "kind"),
    [
        ({"cameras": {"middle": {"source": "http://127.0.0.1/x"}}}, "invalid-request"),
        ({"cameras": {"left": {"source": "http://10.0.0.1/x"}}}, "source-refused"),
        ({"field": None}, "invalid-request"),
        ({"naem": "a"}, "invalid-request"),
        ({"id": "another"}, "venue-id-mismatch"),
        ([], "invalid-request"),
    ],
)
def test_a_patch_that_makes_no_venue_is_refused_and_changes_nothing(service, name, patch, kind):
    before = kept(service.http.put(f"/venues/{name}", json=venue(name)))
    answer = patched(service, name, patch)
    assert problem_of(answer) == (422, kind)
    assert service.http.get(f"/venues/{name}").json() == before


def test_a_patch_of_a_camera_with_a_slip_in_its_name_is_told_those_there_are(service, name):
    service.http.put(f"/venues/{name}", json=venue(name))
    problem = patched(service, name, {"cameras": {"lefft": {"source": "http://127.0.0.1/x"}}}).json()
    assert problem["detail"].startswith("body.cameras.lefft: The venue has the cameras left, right")


def test_a_deleted_venue_is_gone(service, name):
    service.venue(name)
    assert service.http.delete(f"/venues/{name}").status_code == 204
    answer = service.http.get(f"/venues/{name}")
    assert problem_of(answer) == (404, "venue-not-found")
    assert service.http.delete(f"/venues/{name}").status_code == patched(service, name, {}).status_code == 404


def test_a_venue_that_is_created_again_is_not_taken_for_the_old_one(service, name):
    old = service.http.put(f"/venues/{name}", json=venue(name)).headers["etag"]
    service.http.delete(f"/venues/{name}")
    service.venue(name, "other")
    answer = service.http.get(f"/venues/{name}", headers={"If-None-Match": old})
    assert (answer.status_code, answer.json()["name"]) == (200, "other")


@pytest.mark.parametrize(
    ("path", "value", "where"),
    [
        (["surprise"], 1, "surprise"),
        (["field", "length_m"], 5, "field.length_m"),
        (["field", "ridge"], [[0, 0, 1], [1, 1, 1]], "field"),
        (["cameras"], [], "cameras"),
        (["cameras", 0, "id"], "Left!", "cameras.0.id"),
        (["cameras", 0, "id"], "options", "cameras.0"),
        (["cameras", 0, "image_size"], [64, -1], "cameras.0.image_size.1"),
        (["cameras", 0, "intrinsics", "distortion"], [0, 0, 0], "cameras.0.intrinsics"),
        (["cameras", 0, "intrinsics", "matrix", 0, 0], "60", "cameras.0.intrinsics.matrix.0.0"),
        (["cameras", 0, "intrinsics", "matrix", 0, 0], 3.4e6, "cameras.0"),
        (["cameras", 0, "pose", "translation"], [0, 0, 0], "cameras.0.pose"),
        (["cameras", 0, "pose", "position"], None, "cameras.0.pose"),
        (["cameras", 0, "pose", "rotation", 0], True, "cameras.0.pose.rotation.0"),
        (["cameras", 0, "pose", "position", 2], -8.0, "cameras.0"),
    ],
)
def test_a_wrong_venue_is_refused_and_the_place_named(service, name, path, value, where):
    document = venue("wrong")
    inner = document
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = value
    answer = service.http.put("/venues/wrong", json=document)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert f"body.{where}" in [error["where"] for error in answer.json()["errors"]]


def test_a_part_that_is_misspelt_is_told_in_words(service, name):
    document = venue(name)
    document["cameras"][0]["image_sise"] = document["cameras"][0].pop("image_size")
    answer = service.http.put(f"/venues/{name}", json=document).json()
    assert answer["errors"] == [
        {"where": "body.cameras.0.image_size", "message": "cameras.left.image_size is missing"},
        {
            "where": "body.cameras.0.image_sise",
            "message": "cameras.left.image_sise is not known; did you mean image_size?",
        },
    ]
    service.http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    patched = service.http.patch(f"/venues/{name}", json={"cameras": {"left": {"image_sise": [64, 48]}}}).json()
    assert patched["detail"] == "cameras.left.image_sise is not known; did you mean image_size?"
    restored = service.http.post(f"/venues/{name}/restore", json={"revison": 1}).json()
    assert "revison is not known; did you mean revision?" in [error["message"] for error in restored["errors"]]
    asked = service.http.get("/venues", params={"limit": "many"}).json()
    assert asked["detail"] == "query.limit: expected a whole number, came 'many'"


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "9" * 400, "9" * 5000, '"\\ud800"'])
def test_numbers_that_are_none_are_refused(service, number):
    text = json.dumps(venue("wrong")).replace("105", number)
    answer = service.http.put("/venues/wrong", content=text, headers={"Content-Type": "application/json"})
    assert answer.status_code in (400, 422)
    assert answer.json()["type"] in ("/problems/invalid-request", "/problems/malformed-request")


@pytest.mark.parametrize("body", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b"null", b'{"\\ud800": 1}'])
def test_a_body_that_is_no_venue_is_refused(service, body):
    answer = service.http.put("/venues/wrong", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code in (400, 422)
    assert answer.headers["content-type"] == "application/problem+json"


def test_the_id_in_the_address_is_the_id_of_the_venue(service):
    answer = service.http.put("/venues/one", json=venue("other"))
    assert problem_of(answer) == (422, "venue-id-mismatch")


def test_a_venue_may_be_of_another_sport(service, name):
    document = venue(name) | {"field": {"template": "rugby-union", "measures_m": {"in_goal": 8}, "length_m": 116}}
    stored = service.http.put(f"/venues/{name}", json=document).json()
    assert stored["field"]["template"] == "rugby-union"
    assert stored["field"]["width_m"] == 70
    assert service.calibrated(name)["status"] == "succeeded"


def test_a_venue_may_have_markings_of_its_own(service, name):
    layout = {"markings": [{"name": "line", "line": [[-5, 0], [5, 0]]}], "points": {"start": [-5, 0]}}
    field = {"template": layout, "length_m": 10, "width_m": 6, "line_width_m": 0.05}
    stored = kept(service.http.put(f"/venues/{name}", json=venue(name) | {"field": field}))
    assert stored["field"]["template"]["points"] == {"start": [-5, 0]}
    assert service.http.get(f"/venues/{name}").json() == stored
    assert service.calibrated(name)["status"] == "succeeded"


def test_a_sport_that_is_none_is_refused_with_those_there_are(service, name):
    answer = service.http.put(f"/venues/{name}", json=venue(name) | {"field": {"template": "curling"}})
    assert answer.status_code == 422
    assert "curling is none of the templates american-football, basketball" in answer.json()["detail"]
