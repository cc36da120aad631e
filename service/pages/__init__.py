"""The operator's page: rendered here, drawn by plain HTML, CSS and a little JavaScript, nothing from the internet."""

from fastapi import APIRouter

from service.pages import (
    assets,
    calibrate,
    ignore,
    jobs,
    live,
    new_venue,
    problem_pages,
    signin,
    venue_settings,
    venues,
)

# Before the routes of the interface: for browsers alone, at addresses that the interface has as well.
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
    calibrate.router,
    ignore.router,
    venue_settings.router,
    new_venue.router,
    new_venue.data,
    jobs.router,
    problem_pages.document_router,
)
