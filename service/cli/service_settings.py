"""The settings of a service on this machine, as commands load them."""

import os
from typing import Any

from pydantic import ValidationError
from pydantic_settings import SettingsError

from service.cli.printing import USAGE, fail
from service.observability import logs
from service.schemas.findings import describe_errors
from service.secret_files import SecretFileError, bucket_credentials
from service.settings import Settings, setting_names, unread_variables
from service.variable_names import OF_CLIENTS, suggestion


def load_settings(**options: Any) -> Settings:
    """Return the settings of a service on this machine and set up its log, or exit with a line for each error.

    `options`: values of the command line, which go before the environment; None: not given.
    """
    _refuse_unread_variables()
    try:
        bucket_credentials(os.environ)
        settings = Settings(**{name: value for name, value in options.items() if value is not None})
    except ValidationError as error:
        from_options = {name for name, value in options.items() if value is not None}
        lines = []
        for finding in describe_errors(error.errors(), None, None):
            name, _, message = finding.partition(": ")
            setting = f"--{name.removeprefix('worker_')}" if name in from_options else f"ESC_{name.upper()}"
            lines.append(f"{setting}: {message}")
        fail("\n".join(lines), USAGE)
    except SettingsError as error:
        # Raised for a list that is no JSON; the error names its field and nothing else.
        name = str(error).partition('field "')[2].partition('"')[0].upper()
        fail(f'ESC_{name}: expected a list in JSON, for instance ["127.0.0.1"]', USAGE)
    except SecretFileError as error:
        fail(str(error), USAGE)
    logs.configure(settings)
    return settings


def _refuse_unread_variables() -> None:
    """Exit if a variable `ESC_...` is no setting: a misspelt one would have no effect, in silence."""
    known = setting_names() | OF_CLIENTS
    meant = {name: suggestion(name, known) for name in unread_variables()}
    lines = [
        f"unknown setting {name}: " + (f"did you mean {near}?" if near else "docs/settings.md has those there are")
        for name, near in meant.items()
    ]
    if lines:
        fail("\n".join(lines), USAGE)
