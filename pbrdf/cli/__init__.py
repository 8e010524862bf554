"""The command line, the roof of the project: the one place that looks up to all packages.

Every module of `measuring`, `predicting` and `showing` is a command of its name, with
`--help`; a new one is found by being there.
"""

from pbrdf.cli.app import main

__all__ = ["main"]
