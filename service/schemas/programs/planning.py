"""Request of the program that plans cameras before they are mounted."""

from service.schemas.base import Schema
from service.schemas.plan import HiddenShare, LineStateName, PlannedSite


class PlanRequest(Schema):
    """A site, and what its lines are expected to be like."""

    site: PlannedSite
    lines: LineStateName
    hidden: HiddenShare
