"""Preconditions of a change of a venue (RFC 9110, section 13)."""

from dataclasses import dataclass

from service.schemas import etags
from service.schemas.problems import Problem
from service.schemas.venue import Venue


@dataclass(frozen=True)
class Precondition:
    """Headers `If-Match` and `If-None-Match` of a request, each None if it was not sent."""

    if_match: str | None = None
    if_none_match: str | None = None

    def check(self, venue: Venue | None) -> None:
        """Raise the problem `venue-changed` unless the stored venue, None if there is none, meets both headers."""
        tag = None if venue is None else venue_etag(venue)
        got = None if tag is None else etags.quoted(tag)
        if self.if_match is not None and not etags.matches(self.if_match, tag):
            raise Problem("venue-changed", "Read the venue again and decide.", expected=self.if_match[:200], got=got)
        if self.if_none_match is not None and etags.matches(self.if_none_match, tag, weakly=True):
            raise Problem("venue-changed", "The venue is already there.", got=got)


UNCONDITIONAL = Precondition()


def venue_etag(venue: Venue) -> str:
    """Return the entity tag of a venue as clients see it."""
    return etags.of(venue.with_hidden_callbacks().model_dump_json().encode())
