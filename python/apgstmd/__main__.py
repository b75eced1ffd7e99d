"""`python -m apgstmd`: the command line."""

from .cli import main

main()
