"""Which service, and the key for it, where a file `.env` says so.

A module of its own: what reads such files takes longer to load than a command of the client to do its work.
"""

from __future__ import annotations

from pydantic_settings import BaseSettings, SettingsConfigDict


class EnvFile(BaseSettings):
    """What `.env` says of the service that commands call."""

    model_config = SettingsConfigDict(env_prefix="ESC_", env_file=".env", env_ignore_empty=True, extra="ignore")

    url: str | None = None
    api_key: str | None = None
