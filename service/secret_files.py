"""Secrets in files, as Docker and Kubernetes mount them (`NAME_FILE`).

`NAME_FILE` names the file of the secret `NAME`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

# Credentials that the object store would read from the environment itself.
BucketSecret = Literal["access_key_id", "secret_access_key", "session_token"]
BUCKET_SECRETS: tuple[BucketSecret, ...] = ("access_key_id", "secret_access_key", "session_token")


class SecretFileError(ValueError):
    """Raised for a secret that is given twice, or whose file is unreadable or empty; the message never contains it."""


def read_secret(name: str, given: Mapping[str, str | None]) -> str | None:
    """Return the secret in the file that `NAME_FILE` names, without its line end; None where no file is named.

    `given`: environment variables. Raises `SecretFileError` if the variable `name` is set, too, or the file cannot be
    read or is empty.
    """
    file = given.get(f"{name}_FILE")
    if not file:
        return None
    if given.get(name):
        raise SecretFileError(f"{name} and {name}_FILE are both given: take one of them away.")
    try:
        secret = Path(file).read_text(encoding="utf-8").strip()
    except OSError as error:
        raise SecretFileError(f"{name}_FILE: {file} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise SecretFileError(f"{name}_FILE: {file} is no text.") from None
    if not secret:
        raise SecretFileError(f"{name}_FILE: {file} is empty.")
    return secret


def bucket_credentials(given: Mapping[str, str | None]) -> dict[BucketSecret, str]:
    """Return the credentials of an S3 bucket that are in files, by the object store's names."""
    found = {name: read_secret(f"AWS_{name.upper()}", given) for name in BUCKET_SECRETS}
    return {name: secret for name, secret in found.items() if secret is not None}
