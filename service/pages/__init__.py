"""The operator's page: rendered here, drawn by plain HTML, CSS and a little JavaScript, nothing from the internet."""

from fastapi import APIRouter

from service.pages import assets, calibrate, ignore, jobs, newvenue, signin, venues

ROUTERS: tuple[APIRouter, ...] = (
    assets.router,
    signin.router,
    signin.out,
    venues.router,
    venues.data,
    calibrate.router,
    ignore.router,
    newvenue.router,
    newvenue.data,
    jobs.router,
)
