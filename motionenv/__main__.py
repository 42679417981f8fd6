"""`python -m motionenv` is the command `motionenv`."""

from motionenv.cli import main

main()
