"""Errors of the library in the words of the command line: options instead of arguments."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

__all__ = ["in_options", "options_of"]

# Units that an option names and its argument does not
_UNITS = re.compile(r"-(um|deg|nm)$")
# Options of a sensor, and the arguments of the library that they become
_SENSOR = {"--view-zenith-deg": "theta_s", "--view-azimuth-deg": "phi_s"}
# A pair of words behind an option is typed with a comma
_PAIR = re.compile(r"(--[\w-]+) \('([^']+)', '([^']+)'\)")


def options_of(parameters: Iterable[Any]) -> dict[str, str]:
    """Return the option, `--spacing-um`, of each argument, `spacing`, of a command.

    Parameters
    ----------
    parameters : iterable
        What a parsed command takes: `name`, `opts` and `param_type_name`.
    """
    found = {}
    for parameter in parameters:
        option = max(parameter.opts, key=len)
        if parameter.param_type_name == "option" and option.startswith("--"):
            found[parameter.name] = option
            found[_UNITS.sub("", option)[2:].replace("-", "_")] = option
            if option in _SENSOR:
                found[_SENSOR[option]] = option
    return found


def in_options(sentence: str, options: Mapping[str, str]) -> str:
    """Return a message of the library with its arguments named as options.

    Examples
    --------
    >>> options = {"spacing": "--spacing-um"}
    >>> in_options("spacing must be > 0 um, got -1. Pass spacing=0.5.", options)
    '--spacing-um must be > 0 um, got -1. Pass --spacing-um 0.5.'
    >>> in_options("Give spacing=('1', '2').", options)
    'Give --spacing-um 1,2.'
    >>> in_options("Or: --columns x=ignore.", {"scan_columns": "--scan-columns"})
    'Or: --scan-columns x=ignore.'
    """
    if "--scan-columns" in options.values():
        # Beside a surface, which has columns too; those of a scan are given meanings
        sentence = re.sub(r"--columns (?=[^=.;:]{1,60}=)", "--scan-columns ", sentence)
    for name, option in sorted(options.items(), key=lambda pair: -len(pair[0])):
        # A dash or letter before it: the name is part of another word
        sentence = re.sub(rf"(?<![\w-]){name}=(?=[\w'\"(\[])", f"{option} ", sentence)
        sentence = re.sub(rf"(?<![\w-]){name}=", option, sentence)
        sentence = re.sub(rf"^{name} must\b", f"{option} must", sentence)
        sentence = re.sub(rf"--{name.replace('_', '-')}(?![\w-])", option, sentence)
    return _PAIR.sub(r"\1 \2,\3", sentence)
