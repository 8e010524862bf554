"""What the scripts of the paper's figures are told: parameters in TOML, and `--quick`."""

import argparse
import tomllib
from pathlib import Path

__all__ = ["told"]


def told(script, about):
    """Return the settings of a script, and what its quick mode puts in their place.

    The settings are those of parameters.toml beside the script, or of a file that is named.
    """
    parser = argparse.ArgumentParser(description=about)
    beside = Path(script).with_name("parameters.toml")
    parser.add_argument("parameters", nargs="?", type=Path, default=beside)
    parser.add_argument("--quick", action="store_true", help="fewer and smaller runs")
    arguments = parser.parse_args()
    settings = tomllib.loads(arguments.parameters.read_text(encoding="utf-8"))
    return settings, settings["quick"] if arguments.quick else {}
