"""What a line of a list says of a job, and which figures are said to be uncertain."""

from datetime import UTC, datetime

import pytest

from service.cli.answers import outcome_text, print_field_summary
from service.schemas.job import Job
from service.schemas.results import FieldResult, MeasureResult, Provenance
from service.schemas.venue import VenueIn
from testbed.running import venue
from testbed.stock import result

VENUE = VenueIn.model_validate(venue("v")).to_venue()


def job(accepted):
    return Job(
        id="01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
        kind="calibration",
        venue="v",
        status="succeeded",
        progress=None,
        queue_position=None,
        attempt=1,
        created_at=datetime(2026, 11, 3, tzinfo=UTC),
        started_at=None,
        finished_at=None,
        error=None,
        result=result(VENUE, accepted),
        links={},
    )


@pytest.mark.parametrize(
    ("accepted", "line"),
    [
        (True, "accepted"),
        (False, "rejected: the lines do not fit"),
        (["right"], "partly: right accepted; the lines do not fit"),
    ],
)
def test_a_job_is_called_what_its_verdict_says(accepted, line):
    assert outcome_text(job(accepted)) == line


def test_a_measure_that_differs_by_less_than_two_sigma_is_said_to_be_uncertain(capsys):
    measures = [
        MeasureResult(name=name, given=105.0, value=value, sigma=0.1, open=1.0, known=True, detail="")
        for name, value in (("length_m", 105.15), ("width_m", 105.3))
    ]
    provenance = Provenance(software="0", model_sha256="0", seed=1, options={})
    found = FieldResult(
        accepted=True,
        rejected_because=None,
        field=VENUE.field,
        measures=measures,
        cameras=[],
        stitch_error_px=None,
        timings_s={},
        provenance=provenance,
    )
    print_field_summary(found)
    length, width = capsys.readouterr().err.splitlines()
    assert length == "length: 105.150 ± 0.100 m (given 105.000, within its uncertainty)"
    assert width == "width: 105.300 ± 0.100 m (given 105.000)"
