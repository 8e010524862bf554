"""The command line; every command has `--help`."""

from pbrdf.cli.app import main

__all__ = ["main"]
