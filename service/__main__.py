"""`python -m service`, which `motionenv serve` runs."""

from service.server import serve
from service.settings import from_command_line

serve(from_command_line())
