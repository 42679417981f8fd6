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
        place = "".join(f"--{part}: " for part in wrong["loc"][:1])
        print(f"motionenv serve: {place}{wrong['msg']}", file=sys.stderr)  # noqa: T201 the command's own words
    sys.exit(2)
serve(settings)
