"""Results that were stored by an earlier version are read as they are."""

from service.schemas.results import Result
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from testbed.stock import result

ADDED = {"expected_found", "unexpected", "markings", "refusal"}


def test_a_result_from_before_the_evidence_is_read_without_it():
    stored = result(VenueIn.model_validate(VENUE_EXAMPLE).to_venue(), True).model_dump(mode="json")
    old = {name: value for name, value in stored.items() if name != "pairs"}
    old["cameras"] = [
        {name: value for name, value in camera.items() if name not in ADDED} for camera in stored["cameras"]
    ]
    read = Result.model_validate(old)
    assert (read.pairs, read.cameras[0].markings, read.cameras[0].unexpected) == ([], [], None)
    assert read.cameras[0].refusal is None
