"""Settings of the service: environment variables (MOTIONENV_SERVICE_PORT=8080) or flags of `motionenv serve`."""

import ipaddress
import json
import os
import sys
from pathlib import Path
from typing import Self

from platformdirs import user_data_path
from pydantic import Field, SecretStr, ValidationError, model_validator
from pydantic_settings import BaseSettings, CliApp, SettingsConfigDict

_MEGABYTE = 1_000_000


class Settings(BaseSettings):
    """Serve the HTTP API and the web page.

    Each option can also be set by the environment variable MOTIONENV_SERVICE_<OPTION>.
    Example: motionenv serve --port 8080 --workers 2
    """

    model_config = SettingsConfigDict(
        env_prefix="MOTIONENV_SERVICE_", frozen=True, extra="forbid", cli_prog_name="motionenv serve",
        cli_kebab_case=True, cli_implicit_flags=True, cli_hide_none_type=True,
    )  # fmt: skip

    data: Path = Field(
        user_data_path("motionenv") / "service",
        description="Folder for fitted models, jobs and their results; created if missing.",
    )

    job_processes: int = Field(1, ge=1, le=64, description="Fits and films that run at the same time.")
    quick_processes: int = Field(
        1, ge=1, le=64, description="Other jobs, which take seconds, that run at the same time."
    )
    job_seconds: float = Field(900.0, gt=0, description="Maximum duration of a job [s].")
    job_memory: int = Field(
        4_000 * _MEGABYTE, ge=1_000 * _MEGABYTE,
        description="Maximum address space of a job [bytes]; libraries alone take half of the minimum.",
    )  # fmt: skip
    job_days: float = Field(7.0, gt=0, description="Days for which finished jobs and their results are kept.")
    reserve: int = Field(
        64 * _MEGABYTE, ge=0, description="Disk space to keep free [bytes]; with less, uploads get 507."
    )

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0: any free one.")
    workers: int = Field(1, ge=1, le=64, description="Server processes.")
    keys: tuple[SecretStr, ...] = Field(
        (), description="API keys, a JSON list. If there are any, every request needs one. Set them in the "
        "environment: flags are visible in process listings.",
    )  # fmt: skip
    admin_keys: tuple[SecretStr, ...] = Field(
        (), description="API keys that see the jobs and models of all keys, a JSON list."
    )
    open: bool = Field(False, description="Allow access from other machines without keys.")
    hosts: tuple[str, ...] = Field(
        (), description="Host names, besides localhost, accepted by a service without keys, a JSON list; wildcards "
        "(*.example.com) are allowed. Other hosts get 400: protection against DNS rebinding.",
    )  # fmt: skip
    cors: tuple[str, ...] = Field((), description="Origins of web pages that may use the API (CORS), a JSON list.")
    proxies: str = Field("", description="Addresses of trusted proxies, whose X-Forwarded-* headers are used.")
    rate: int = Field(
        0, ge=0, description="Requests per minute for each key or address, counted by each process; 0: unlimited."
    )

    max_upload: int = Field(64 * _MEGABYTE, ge=1, description="Maximum size of an upload [bytes].")
    max_json: int = Field(12 * _MEGABYTE, ge=1, description="Maximum size of any other request body [bytes].")
    max_frames: int = Field(36_000, ge=1, description="Maximum number of frames of a motion.")
    max_pixels: int = Field(1920 * 1080, ge=256, description="Maximum number of pixels of a picture.")
    max_video_frames: int = Field(1_800, ge=1, description="Maximum number of frames of a video.")

    threads: int = Field(len(os.sched_getaffinity(0)), ge=1, le=256, description="Worker threads of each process.")
    waiting: int = Field(32, ge=0, description="Requests that may wait for a worker thread; more get 503.")
    streams: int = Field(32, ge=0, description="Maximum number of open streams (WebSockets) of each process.")
    request_seconds: float = Field(60.0, gt=0, description="Seconds after which a request without a response gets 504.")
    shutdown_seconds: float = Field(30.0, ge=0, description="Seconds that running requests have to finish at shutdown.")

    job_waiting: int = Field(100, ge=1, description="Jobs of either kind that may be queued; more get 503.")

    @property
    def all_keys(self) -> tuple[SecretStr, ...]:
        """Keys of both kinds."""
        return self.keys + self.admin_keys

    def environment(self) -> dict[str, str]:
        """The settings as environment variables, keys included: never log them."""
        values = self.model_dump(mode="json") | {
            name: [key.get_secret_value() for key in getattr(self, name)] for name in ("keys", "admin_keys")
        }
        return {
            f"MOTIONENV_SERVICE_{name.upper()}": value if isinstance(value, str) else json.dumps(value)
            for name, value in values.items()
        }

    @model_validator(mode="after")
    def _safe(self) -> Self:
        if not self.all_keys and not self.open and not _loopback(self.host):
            raise ValueError(
                f"host {self.host!r} is reachable from other machines, but there are no keys: "
                "set keys, or open=true to allow access without keys"
            )
        if any(len(key.get_secret_value()) < 16 for key in self.all_keys):
            raise ValueError(
                "each key must have at least 16 characters: "
                "python -c 'import secrets; print(secrets.token_urlsafe())' makes one"
            )
        return self


def from_command_line() -> Settings:
    """Settings from flags and environment; what is wrong goes to stderr, and the process ends with 2."""
    try:
        return CliApp.run(Settings, cli_exit_on_error=True)
    except ValidationError as error:
        for wrong in error.errors():
            place = "".join(f"--{str(part).replace('_', '-')}: " for part in wrong["loc"][:1])
            secret = wrong["loc"] and wrong["loc"][0] in ("keys", "admin_keys")
            given = f", got {wrong['input']!r}" if wrong["loc"] and not secret else ""
            words = f"{place}{wrong['msg'].removeprefix('Value error, ')}{given}"
            print(f"motionenv serve: {words}", file=sys.stderr)  # noqa: T201 the command's words
        sys.exit(2)


def _loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
