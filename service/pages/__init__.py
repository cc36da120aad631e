"""The operator's web pages, rendered on the server, with nothing from the internet."""

from fastapi import APIRouter

from service.pages import assets, jobs, live, new_venue, problem_pages, signin, venue_forms, venues

# Included before the routes of the interface: at the same paths, for browsers alone.
FOR_BROWSERS: APIRouter = problem_pages.router
show_browsers_what_is_missing = problem_pages.show_browsers_what_is_missing
ROUTERS: tuple[APIRouter, ...] = (
    assets.router,
    assets.at_the_root,
    signin.router,
    signin.out,
    venues.router,
    venues.data,
    live.data,
    venue_forms.router,
    new_venue.router,
    new_venue.data,
    jobs.router,
    problem_pages.document_router,
)
