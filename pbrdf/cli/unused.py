"""Which options were typed; those that a command would not look at are refused."""

from collections.abc import Collection

import typer

__all__ = ["refuse_unused", "was_typed"]


def was_typed(context: typer.Context, name: str) -> bool:
    """Tell whether a parameter of a command was given on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def refuse_unused(context: typer.Context, names: Collection[str], beside: str) -> None:
    """Refuse options that were typed and would change nothing.

    Parameters
    ----------
    context : typer.Context
        Of the command.
    names : collection of str
        Parameters of the command's function.
    beside : str
        What makes them useless, as in "beside --scene".

    Raises
    ------
    ValueError
        Naming the first of them.
    """
    for parameter in context.command.params:
        if parameter.name in names and was_typed(context, parameter.name):
            msg = f"{parameter.opts[0]} is not used {beside}. Leave it out."
            raise ValueError(msg)
