"""`python -m cathxr` is the `cathxr` command."""

from cathxr.app.cli import main

main(prog_name="cathxr")
