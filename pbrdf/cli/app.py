"""Entry point: run a command; say in one line on stderr what is wrong and how to mend it.

Commands import what they need when they run, so that `pbrdf --help` stays quick.
"""

import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pkgutil import iter_modules
from typing import Annotated, Any

import typer

from pbrdf import __version__
from pbrdf.cli import measuring, predicting, showing
from pbrdf.cli.progress import Talk, talk
from pbrdf.cli.typed import remember, remembering_paths
from pbrdf.cli.wording import in_options, options_of
from pbrdf.errors import visible
from pbrdf.files.writing import FULL

__all__ = ["app", "main"]

_TALK = ("--quiet", "--verbose")
_ROOM = "Make room, or write elsewhere."
_MEMORY = "Take fewer bins, angles or wavelengths at once (--n-theta, --n-dphi, --stokes)."

FAILED = 1
BAD_INPUT = 2
INTERRUPTED = 130
TERMINATED = 143


class TerminatedError(BaseException):
    """The process was asked to end; what is half written is cleared away."""


app = typer.Typer(
    name="pbrdf",
    help="Polarised reflectance of real rough surfaces: measured, simulated and fitted.",
    no_args_is_help=False,
    add_completion=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"pbrdf {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_version, is_eager=True, help="Show the version."
        ),
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="No progress and no remarks on stderr.")
    ] = False,
    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Where an error was raised, and each stage."),
    ] = False,
) -> None:
    """Polarised reflectance of real rough surfaces: measured, simulated and fitted.

    --quiet and --verbose are of every command: pbrdf simulate scene.toml --quiet
    """
    talk(Talk.QUIET if quiet else Talk.VERBOSE if verbose else Talk.NORMAL)


def _commands() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Name and function of every command: each module of a room of commands holds one."""
    for room in (measuring, predicting, showing):
        for module in iter_modules(room.__path__):
            command = import_module(f"{room.__name__}.{module.name}").command
            yield module.name.replace("_", "-"), command


COMMANDS = dict(_commands())
for name, function in COMMANDS.items():
    app.command(name)(remembering_paths(function))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        What the user typed after `pbrdf`; sys.argv without it.

    Returns
    -------
    int
        0, 2 for input that cannot be used, 130 when interrupted. A fault of the program
        itself is not caught. --verbose shows where an error was raised.
    """
    arguments = _talk_first(sys.argv[1:] if arguments is None else arguments)
    remember(arguments)
    talk(Talk.NORMAL)
    with warnings.catch_warnings(), _ending_in_order():
        warnings.showwarning = partial(_one_line_warning, arguments)
        try:
            code = app(
                args=arguments or ["--help"], prog_name="pbrdf", standalone_mode=False
            )
        except typer.TyperException as error:
            return _fail(error, _usage(error, arguments))
        except OSError as error:
            if error.errno in FULL:
                return _fail(error, f"{error.filename}: {error.strerror}. {_ROOM}", FAILED)
            return _fail(error, _sentence(error))
        except MemoryError as error:
            return _fail(error, f"out of memory. {_MEMORY}", FAILED)
        except UnicodeEncodeError as error:
            text = str(error.object[max(error.start - 20, 0) : error.end])
            return _fail(error, f"{text!a} cannot be written as UTF-8. Rename that file.")
        except ValueError as error:
            return _fail(error, _in_words_of_the_command(_sentence(error), arguments))
        except (KeyboardInterrupt, typer.Abort) as error:
            typer.echo(f"Interrupted; {_kept(error)}.", err=True)
            return INTERRUPTED
        except TerminatedError as error:
            typer.echo(f"Terminated; {_kept(error)}.", err=True)
            return TERMINATED
    return code if isinstance(code, int) else 0


def _talk_first(arguments: Sequence[str]) -> list[str]:
    """Put --quiet and --verbose, which are of every command, before the command."""
    said = [word for word in arguments if word in _TALK]
    return said + [word for word in arguments if word not in _TALK]


@contextmanager
def _ending_in_order() -> Iterator[None]:
    """Turn SIGTERM into an exception, so that what is half written is cleared away."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: object) -> None:
        raise TerminatedError

    earlier = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, earlier)


def _kept(error: BaseException) -> str:
    """Say what an ended command leaves: what it noted on the way out, or nothing."""
    return "; ".join(getattr(error, "__notes__", [])) or "nothing was written"


def _fail(error: Exception, message: str, code: int = BAD_INPUT) -> int:
    if os.environ.get("PBRDF_TRACEBACK") or talk() is Talk.VERBOSE:
        raise error
    typer.echo(f"error: {visible(message)}", err=True)
    return code


def _command_of(arguments: Sequence[str]) -> str | None:
    """Name of the command among the arguments."""
    return next((word for word in arguments if word in COMMANDS), None)


def _in_words_of_the_command(sentence: str, arguments: Sequence[str]) -> str:
    name = _command_of(arguments)
    if name is None:
        return sentence
    parsed: Any = typer.main.get_command(app)
    return in_options(sentence, options_of(parsed.commands[name].params))


def _sentence(error: Exception) -> str:
    """Return the message of an error on one line, with a full stop."""
    if isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename}: {error.strerror}. Check the name and the rights"
    elif isinstance(error, typer.TyperException):
        text = error.format_message()
    else:
        text = str(error) or type(error).__name__
    text = visible(text)
    return text if text.endswith((".", "!", "?")) else f"{text}."


def _usage(error: typer.TyperException, arguments: Sequence[str]) -> str:
    """Return what is wrong with the arguments, the value, and where help is."""
    sentence = _sentence(error).replace("Value error, ", "")
    option = re.search(r"'(--[a-z-]+)'", sentence)
    if option and option[1] in arguments[:-1]:
        value = arguments[arguments.index(option[1]) + 1]
        if repr(value) not in sentence:
            sentence = f"{sentence.rstrip('.')}, got {value!r}."
    name = _command_of(arguments)
    return f"{sentence} See `pbrdf {f'{name} ' if name else ''}--help`."


def _one_line_warning(
    arguments: Sequence[str], message: Warning | str, *_: object, **__: object
) -> None:
    if talk() is not Talk.QUIET:
        text = _in_words_of_the_command(visible(str(message)), arguments)
        typer.echo(f"warning: {text}", err=True)
