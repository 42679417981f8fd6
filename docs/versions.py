"""What the version switcher of the published site offers.

python docs/versions.py PUBLISHED /motionenv     writes switcher.json and index.html into the folder PUBLISHED,
                                                 which holds a folder for each version and is served under /motionenv
"""

import json
import sys
from pathlib import Path

from packaging.version import InvalidVersion, Version

DEVELOPMENT = "dev"


def versions_in(published: Path) -> list[str]:
    """The versions that have a folder, the newest release first, what is being developed last."""
    releases = []
    for folder in published.iterdir():
        try:
            releases.append((Version(folder.name), folder.name))
        except InvalidVersion:  # such as .git
            continue
    newest_first = [name for _, name in sorted(releases, reverse=True)]
    return [*newest_first, DEVELOPMENT] if (published / DEVELOPMENT).is_dir() else newest_first


def write(published: Path, base: str) -> None:
    """Write the switcher's list, and a page that leads to the newest release, or to what is being developed.

    `base` is where the folder `published` is served, without a slash at the end.
    """
    versions = versions_in(published)
    if not versions:
        sys.exit(f"{published} has no folder of a version, such as 1.0.0 or {DEVELOPMENT}: build the site into one")
    stable = next((v for v in versions if v == DEVELOPMENT or not Version(v).is_prerelease), versions[0])
    told = [
        {"name": f"{v} (stable)" if v == stable != DEVELOPMENT else v, "version": v, "url": f"{base}/{v}/",
         "preferred": v == stable}
        for v in versions
    ]  # fmt: skip
    (published / "switcher.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    page = (
        f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>motionenv</title>\n'
        f'<meta http-equiv="refresh" content="0; url={base}/{stable}/">\n'
        f'<p><a href="{base}/{stable}/">motionenv {stable}</a></p></html>\n'
    )
    (published / "index.html").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    write(Path(sys.argv[1]), sys.argv[2].rstrip("/"))
