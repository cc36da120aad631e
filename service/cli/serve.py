"""`esc up` and `serve`: a service, or its API alone."""

from service import confinement, serving
from service.cli.arguments import Data, Host, Port
from service.cli.local_database import prepared_home
from service.cli.printing import USAGE, fail
from service.cli.service_settings import load_settings
from service.settings import Settings


def up(data: Data = None, host: Host = None, port: Port = None) -> None:
    """Run the whole service on this machine: API, operator's page and one worker, with nothing else beside them."""
    confinement.hide_memory()
    _serve(load_settings(data=data, host=host, port=port), with_worker=True)


def serve(data: Data = None, host: Host = None, port: Port = None) -> None:
    """Run the API and the operator's page alone; `esc worker` computes, here or on other machines."""
    confinement.hide_memory()
    _serve(load_settings(data=data, host=host, port=port), with_worker=False)


def _serve(settings: Settings, *, with_worker: bool) -> None:
    try:
        with prepared_home(settings, with_worker=with_worker):
            serving.serve(settings, with_worker=with_worker)
    except serving.CannotListen as error:
        fail(str(error), USAGE)
