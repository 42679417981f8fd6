"""What motionenv needs to run, and under which licences: all of them permit what ours (MIT) permits.

python docs/licences.py     prints the table; ends with 1 if a licence isn't known to be compatible
"""

import re
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution

from packaging.requirements import Requirement

#: Licences that may be combined with MIT, by their SPDX identifiers or what stands for them in older packages.
COMPATIBLE = (
    "0BSD", "Apache", "BSD", "CC0", "HPND", "ISC", "LLVM-exception", "MIT", "MPL", "Mozilla Public License", "PSF",
    "Python Software Foundation", "Unlicense", "Zlib",
)  # fmt: skip
#: Packages whose metadata don't say it; their source distributions do.
UNSTATED = {"pyglet": "BSD-3-Clause"}


def needed(name: str) -> dict[str, Distribution]:
    """The distributions that `name` needs on this system, itself left out, by their names."""
    found: dict[str, Distribution] = {}
    waiting = [name]
    while waiting:
        for line in distribution(waiting.pop()).requires or ():
            requirement = Requirement(line)
            wanted = requirement.marker is None or requirement.marker.evaluate({"extra": ""})
            key = re.sub(r"[-_.]+", "-", requirement.name).lower()
            if not wanted or key in found:
                continue
            try:
                found[key] = distribution(requirement.name)
            except PackageNotFoundError:
                sys.exit(f"{requirement.name} isn't installed: pip install {name}")
            waiting.append(requirement.name)
    return dict(sorted(found.items()))


def licence(package: Distribution) -> str:
    """What a distribution says: an SPDX expression, or its classifiers, or the first line of free text."""
    about = package.metadata
    if about["License-Expression"]:
        return about["License-Expression"]
    classified = [c.rpartition(" :: ")[2] for c in about.get_all("Classifier") or () if c.startswith("License ::")]
    stated = [c for c in classified if c != "OSI Approved"] or (about["License"] or "").splitlines()[:1]
    return "; ".join(stated) or UNSTATED.get(about["Name"].lower(), "not stated")


def compatible(text: str) -> bool:
    """Whether every part of an expression, or one side of each "or", is known to be compatible."""
    return all(
        any(known in choice for known in COMPATIBLE for choice in re.split(r" OR ", part))
        for part in re.split(r" AND |;", text)
    )


def table() -> str:
    """A row for each package, in Markdown."""
    rows = [f"| {package.metadata['Name']} | {licence(package)} |" for package in needed("motionenv").values()]
    return "\n".join(["| package | licence |", "|-|-|", *rows])


if __name__ == "__main__":
    print(table())
    wrong = [name for name, package in needed("motionenv").items() if not compatible(licence(package))]
    if wrong:
        sys.exit(f"look at the licences of {', '.join(wrong)}")
