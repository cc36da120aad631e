"""Address and key of the service in a file `.env`."""

from pydantic_settings import BaseSettings, SettingsConfigDict


class EnvFile(BaseSettings):
    """Variables of `.env` that commands of the client read."""

    model_config = SettingsConfigDict(env_prefix="ESC_", env_file=".env", env_ignore_empty=True, extra="ignore")

    url: str | None = None
    api_key: str | None = None
