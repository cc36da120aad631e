"""`esc up` and `serve`: a service, or its API alone."""

from service import confinement, serving
from service.cli.arguments import Data, Host, Port
from service.cli.local_database import report_database_errors, require_folders, require_local_database
from service.cli.printing import USAGE, fail
from service.cli.service_settings import load_settings
from service.settings import Settings
from service.worker_lock import AlreadyRunning


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
        with report_database_errors(settings):
            require_local_database(settings)
            require_folders(settings, with_worker=with_worker)
            serving.serve(settings, with_worker=with_worker)
    except (serving.CannotListen, AlreadyRunning) as error:
        fail(str(error), USAGE)
