"""What can be set: by environment (MOTIONENV_SERVICE_PORT=8080) or by the flags of `motionenv serve`."""

import ipaddress
import json
import os
from pathlib import Path
from typing import Self

from platformdirs import user_data_path
from pydantic import Field, SecretStr, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

_MEGABYTE = 1_000_000


class Settings(BaseSettings):
    """Serve motion over HTTP, and the page on which to play with it.

    Each option can be set by the environment variable MOTIONENV_SERVICE_<OPTION> too.
    Example: motionenv serve --port 8080 --workers 2
    """

    model_config = SettingsConfigDict(
        env_prefix="MOTIONENV_SERVICE_", frozen=True, extra="forbid",
        cli_prog_name="motionenv serve", cli_kebab_case=True, cli_implicit_flags=True, cli_hide_none_type=True,
    )  # fmt: skip

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one.")
    workers: int = Field(1, ge=1, le=64, description="Processes that answer.")
    data: Path = Field(
        user_data_path("motionenv") / "service",
        description="Folder of fitted models, jobs and their results; made when missing.",
    )
    keys: tuple[SecretStr, ...] = Field(
        (), description="API keys, a JSON list; with any, every request needs one. Whoever lists this machine's "
        "processes can read flags: the environment keeps them better.",
    )  # fmt: skip
    open: bool = Field(False, description="Listen beyond this machine without keys.")
    hosts: tuple[str, ...] = Field(
        (), description="Names, beside localhost, by which a service without keys may be asked, a JSON list: any site "
        "can make its name lead here, so others are refused.",
    )  # fmt: skip
    cors: tuple[str, ...] = Field((), description="Origins whose pages may ask, a JSON list; none by default.")
    proxies: str = Field("", description="Addresses of proxies whose X-Forwarded-* headers are believed.")
    rate: int = Field(
        0, ge=0, description="Requests a minute that each process answers to each key, or address; 0: any number."
    )

    max_upload: int = Field(64 * _MEGABYTE, ge=1, description="Bytes of an upload at most.")
    max_json: int = Field(4 * _MEGABYTE, ge=1, description="Bytes of any other body at most.")
    max_frames: int = Field(36_000, ge=1, description="Frames of a motion at most.")
    max_pixels: int = Field(1920 * 1080, ge=256, description="Pixels of a picture at most.")
    max_video_frames: int = Field(1_800, ge=1, description="Frames of a video at most.")

    threads: int = Field(
        len(os.sched_getaffinity(0)), ge=1, le=256, description="Threads that compute, in each process."
    )
    waiting: int = Field(32, ge=0, description="Requests that may wait for such a thread; more get 503.")
    streams: int = Field(32, ge=0, description="WebSockets that get motion at a time, in each process.")
    request_seconds: float = Field(60.0, gt=0, description="Seconds until the answer of a request must begin.")
    shutdown_seconds: float = Field(30.0, ge=0, description="Seconds that running requests have to end at shutdown.")

    job_processes: int = Field(1, ge=1, le=64, description="Jobs that run at a time.")
    job_waiting: int = Field(100, ge=1, description="Jobs that may wait; more get 503.")
    job_seconds: float = Field(900.0, gt=0, description="Seconds that a job may take.")
    job_memory: int = Field(
        4_000 * _MEGABYTE, ge=1_000 * _MEGABYTE,
        description="Bytes of address space that a job may take; libraries alone take half of the least.",
    )  # fmt: skip
    job_days: float = Field(7.0, gt=0, description="Days that jobs that have ended, and their results, are kept.")
    reserve: int = Field(64 * _MEGABYTE, ge=0, description="Bytes of disk kept free; below it, uploads get 507.")

    def environment(self) -> dict[str, str]:
        """The settings as environment variables: keys too, so not for anybody's eyes."""
        values = self.model_dump(mode="json") | {"keys": [key.get_secret_value() for key in self.keys]}
        return {
            f"MOTIONENV_SERVICE_{name.upper()}": value if isinstance(value, str) else json.dumps(value)
            for name, value in values.items()
        }

    @model_validator(mode="after")
    def _safe(self) -> Self:
        """Refuse to be open to others by accident."""
        if not self.keys and not self.open and not _loopback(self.host):
            raise ValueError(
                f"host {self.host!r} can be reached from other machines and keys is empty: "
                "set keys, or open=true if anybody may ask"
            )
        if any(len(key.get_secret_value()) < 16 for key in self.keys):
            raise ValueError(
                "keys must have 16 characters at least: python -c 'import secrets; print(secrets.token_urlsafe())'"
            )
        return self


def _loopback(host: str) -> bool:
    """Whether `host` can be reached from this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
