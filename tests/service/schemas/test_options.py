import pytest
from pydantic import ValidationError

from service.schemas.options import Options


def test_options_have_the_documented_defaults():
    assert Options().model_dump(exclude_none=True) == {
        "preset": "esc",
        "search": "auto",
        "generations": 100,
        "parents": 64,
        "offspring": 128,
        "stitch_weight": 0.5,
        "flat": False,
        "fit_focal_length": False,
        "fit_ridge": False,
        "dry_run": False,
        "pictures": False,
        "priority": "routine",
    }


def test_what_only_the_finish_finds_needs_the_preset_that_has_one():
    assert Options(fit_focal_length=True, fit_ridge=True).fit_ridge
    for wrong in ({"preset": "paper", "fit_ridge": True}, {"flat": True, "fit_ridge": True}):
        with pytest.raises(ValidationError, match="fit_ridge"):
            Options.model_validate(wrong)
