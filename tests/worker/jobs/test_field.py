"""Fields of which sports can be fitted."""

import pytest

from service.schemas.options import FieldOptions
from service.schemas.venue import VenueIn
from worker.compute_resources import ComputeResources
from worker.jobs.field import solve
from worker.jobs.from_schemas import JobFailedError


def refusal(tmp_path, template, length_m, width_m):
    """How a fit of such a field ends on a machine that has no network: of the field first."""
    camera = {
        "id": "left",
        "image_size": [320, 180],
        "intrinsics": {"matrix": [[220, 0, 160], [0, 220, 90], [0, 0, 1]], "distortion": []},
        "pose": {"rotation": [1.675, 0.372, -0.462], "position": [-1, -49, 8]},
    }
    field = {"template": template, "length_m": length_m, "width_m": width_m}
    venue = VenueIn.model_validate({"id": "v", "field": field, "cameras": [camera]}).to_venue()
    with pytest.raises(JobFailedError) as refused:
        solve(
            venue,
            {"left": []},
            FieldOptions(),
            ComputeResources(model=tmp_path / "none.onnx", threads=1),
            lambda _: None,
        )
    return refused.value.error


@pytest.mark.parametrize(
    ("template", "length_m", "width_m"),
    [("football", 105, 68), ("hockey", 91.4, 55), ("handball", 40, 20), ("handball", 38, 18), ("rugby-union", 100, 70)],
)
def test_a_field_of_any_sport_can_be_fitted(tmp_path, template, length_m, width_m):
    assert refusal(tmp_path, template, length_m, width_m).type == "/problems/model-missing"
