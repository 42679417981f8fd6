"""`python -m service`, which `motionenv serve` runs: settings from flags and environment, then `serve`."""

import sys

from pydantic import ValidationError
from pydantic_settings import CliApp

from service.server import serve
from service.settings import Settings

try:
    settings = CliApp.run(Settings, cli_exit_on_error=True)
except ValidationError as error:
    for wrong in error.errors():
        place = "".join(f"--{str(part).replace('_', '-')}: " for part in wrong["loc"][:1])
        given = f", got {wrong['input']!r}" if wrong["loc"] and wrong["loc"][0] != "keys" else ""  # keys stay secret
        words = f"{place}{wrong['msg'].removeprefix('Value error, ')}{given}"
        print(f"motionenv serve: {words}", file=sys.stderr)  # noqa: T201 the command's own words
    sys.exit(2)
serve(settings)
