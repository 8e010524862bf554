"""`python -m pbrdf`: the command line."""

from pbrdf.cli import main

main()
