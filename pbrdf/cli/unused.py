"""Options that a command would not look at are refused, not dropped."""

from collections.abc import Collection

import typer

__all__ = ["refuse_unused"]


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
        source = context.get_parameter_source(str(parameter.name))
        typed = source is not None and source.name == "COMMANDLINE"
        if typed and parameter.name in names:
            msg = f"{parameter.opts[0]} is not used {beside}. Leave it out."
            raise ValueError(msg)
