"""Builds the page into `service/web/dist`, where npm is: part of `pip install .`, of wheels and of editable installs.

Without npm, or where npm can't fetch what it needs, the package is built without the page, and the service says so.
"""

import hashlib
import shutil
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_SECONDS = 300
_MADE = ("dist", "node_modules")


class PageHook(BuildHookInterface):
    """Runs npm and esbuild unless the page in `dist` is of these very sources."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page.

        Args:
            version: "standard" or "editable".
            build_data: of hatchling.
        """
        if self.target_name != "wheel":
            return
        web = Path(self.root) / "service" / "web"
        stamp, sources = web / "dist" / "SOURCES", _digest(web)
        if stamp.is_file() and stamp.read_text() == sources:
            return
        npm = shutil.which("npm")
        if npm is None:
            self.app.display_warning("npm isn't installed: motionenv is built without its page")
            return
        shutil.rmtree(web / "dist", ignore_errors=True)
        try:
            for command in (["ci", "--no-audit", "--no-fund"], ["run", "build"]):
                subprocess.run([npm, *command], cwd=web, check=True, timeout=_SECONDS, capture_output=True, text=True)
        except (subprocess.SubprocessError, OSError) as error:
            shutil.rmtree(web / "dist", ignore_errors=True)
            said = getattr(error, "stderr", None) or error
            self.app.display_warning(f"npm failed: motionenv is built without its page\n{said}")
            return
        stamp.write_text(sources)


def _digest(web: Path) -> str:
    """Of all sources of the page, so that it is made anew when any changes."""
    paths = [path for path in sorted(web.rglob("*")) if path.is_file() and path.relative_to(web).parts[0] not in _MADE]
    digest = hashlib.blake2b(digest_size=16)
    for path in paths:
        digest.update(path.relative_to(web).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
