"""A database that release 0.2.0 left, opened and served by this version."""

import sqlalchemy as sa
from obstore.store import from_url

from service.store import tables
from testbed.homes import in_both_homes
from testbed.released import load_dump
from testbed.running import png, wait_for


@in_both_homes
def test_a_database_of_the_last_release_is_served_as_it_was_and_its_waiting_job_is_computed(home, start, tmp_path):
    folder = tmp_path / "esc"
    answers = load_dump(home, folder)
    service = start("serve")
    for address, answer in answers.items():
        assert differences(answer, service.http.get(address).raise_for_status().json(), address) == []
    (waiting,) = (job["id"] for job in answers["/jobs"]["jobs"] if job["status"] == "queued")
    store = from_url(home.blob_url(folder))
    with service.database() as connection:
        frames = connection.scalar(sa.select(tables.jobs.c.frames).where(tables.jobs.c.id == waiting))
    for paths in frames.values():
        store.put(paths[0], png())
    assert service.stop() == 0
    service = start()
    ended = service.end(waiting)
    assert (ended["status"], ended["error"]) == ("succeeded", None)
    # The same content under the same key is still the same job, and the venue is calibrated on.
    again = service.submit("waiting", headers={"Idempotency-Key": "waits"})
    assert (again.status_code, again.json()["id"]) == (200, waiting)
    assert service.calibrated("everything", shade=2)["result"]["accepted"]
    history = "/venues/everything/history"
    wait_for(lambda: len(service.http.get(history).json()["revisions"]) == len(answers[history]["revisions"]) + 1)


def differences(before, now, where):
    """Return where an answer lacks what the release answered; fields may have been added since."""
    if isinstance(before, dict) and isinstance(now, dict):
        pairs = [(name, value, now.get(name)) for name, value in before.items()]
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        pairs = [(number, *pair) for number, pair in enumerate(zip(before, now, strict=True))]
    else:
        return [] if before == now else [f"{where}: {before} is {now} now"]
    return [found for name, old, new in pairs for found in differences(old, new, f"{where}.{name}")]
