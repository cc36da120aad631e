"""The wire's models for the job program: models to a type checker, plain JSON objects while the program runs.

The models take longer to load than a near job takes to refine a camera. The parent of the program has checked what it
sends by the models, and checks by them what the program answers.
"""

import json
from collections.abc import Collection, Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from service.schemas.geometry import Intrinsics as Intrinsics
    from service.schemas.geometry import Light as Light
    from service.schemas.geometry import Moved as Moved
    from service.schemas.geometry import Pose as Pose
    from service.schemas.job import JobError as JobError
    from service.schemas.job import Progress as Progress
    from service.schemas.results import AdoptableNumber as AdoptableNumber
    from service.schemas.results import CameraResult as CameraResult
    from service.schemas.results import CrossCheck as CrossCheck
    from service.schemas.results import LensChange as LensChange
    from service.schemas.results import MarkingResult as MarkingResult
    from service.schemas.results import PairResult as PairResult
    from service.schemas.results import Proposal as Proposal
    from service.schemas.results import Provenance as Provenance
    from service.schemas.results import Refined as Refined
    from service.schemas.results import Result as Result
    from service.schemas.results import SeamPlace as SeamPlace
    from service.schemas.results import Sigma as Sigma
    from service.schemas.results import Suspicion as Suspicion
    from service.schemas.results import View as View
    from service.schemas.trend import Displacement as Displacement
    from service.store.jobs.task import Task


class Document(dict[str, Any]):
    """A JSON object whose members are attributes too, with those two methods of a model that the program calls."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def model_copy(self, *, update: Mapping[str, Any]) -> "Document":
        """Return the document with other members."""
        return Document({**self, **update})

    def model_dump(self, *, mode: str = "json", exclude: Collection[str] = ()) -> dict[str, Any]:
        """Return the document as JSON has it, which it is already, without some of its members."""
        assert mode == "json"
        return {name: value for name, value in self.items() if name not in exclude}


if not TYPE_CHECKING:
    AdoptableNumber = CameraResult = CrossCheck = Displacement = Intrinsics = JobError = LensChange = Document
    Light = MarkingResult = Moved = PairResult = Pose = Progress = Proposal = Provenance = Document
    Refined = Result = SeamPlace = Sigma = Suspicion = View = Document


def parse(text: str | bytes) -> Any:
    """Return the value of a JSON text, its objects as documents."""
    return json.loads(text, object_hook=Document)


def parse_task(document: Document) -> "Task":
    """Return the task of a request."""
    taken_at = document.taken_at and datetime.fromisoformat(document.taken_at)
    return cast("Task", document.model_copy(update={"taken_at": taken_at}))
