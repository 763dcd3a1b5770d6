"""The entry of the command line: subcommands, exit codes, errors in one line."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from typing import Annotated

import typer

from ..errors import MeshgaugeError
from ..files import resources, sources
from ..files.standard import unwritten
from . import command, interrupts, streams, terminal
from .terminal import COULD_NOT, DONE, TRACEBACK

_COMMANDS = (
    "report",
    "merge",
    "check",
    "compare",
    "trend",
    "doctor",
    "improve",
    "orient",
    "undo",
    "plot",
    "paraview-plugin",
    "view",
    "metrics",
    "formats",
    "explain",
    "schema",
)
"""The subcommands in the order of the help, each a function in the file of its name."""


def _program(names: Iterable[str]) -> typer.Typer:
    """The program with some of its subcommands."""
    made = typer.Typer(
        name="meshgauge",
        help="Measure every cell of a mesh, of every type, with one number.",
        epilog="Start with: [bold]meshgauge report MESH[/bold]",
        invoke_without_command=True,
        cls=command.Commands,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    for name in (one.replace("-", "_") for one in names):
        command.add(made, getattr(import_module(f".{name}", __package__), name))
    made.callback()(_root)
    return made


@cache
def program() -> typer.Typer:
    """The program with all of its subcommands."""
    return _program(_COMMANDS)


def _asked(arguments: list[str]) -> typer.Typer:
    """The program, or what is named first of it: to look at all options takes as long as to read a small mesh."""
    return _program(arguments[:1]) if arguments and arguments[0] in _COMMANDS else program()


def _version(asked: bool) -> None:
    if asked:
        from .._version import __version__

        typer.echo(f"meshgauge {__version__}")
        raise typer.Exit


def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 2 could not, 130 Ctrl-C. Never a traceback."""
    interrupts.forget()
    streams.prepare()
    code = _code(arguments)
    unwritten = streams.flush()
    return code if unwritten is None else failed(unwritten)


def _code(arguments: list[str] | None) -> int:
    try:
        resources.require(32 << 20, "the program", address_space=192 << 20)
        with sources.guard():
            asked = _asked(sys.argv[1:] if arguments is None else arguments)
            code = asked(args=arguments, prog_name="meshgauge", standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort):
        return interrupts.code()
    except SystemExit:
        return DONE  # Typer's answer to a pipe that was closed while it printed help
    except BrokenPipeError:
        return DONE  # nobody reads any more
    except (MeshgaugeError, OSError) as error:
        if interrupts.is_asked():
            return interrupts.code()
        if isinstance(error, OSError) and error.errno == errno.ENOSPC and error.filename is None:
            return failed(unwritten(error))  # of the help, which Typer prints
        return failed(str(error))
    except MemoryError as error:  # nothing of it is unexpected: the system's words say how much was asked for
        return failed(f"too little memory: {error or 'the work does not fit'}")
    except Exception as error:
        if interrupts.is_asked():  # while a library was loaded or at work
            return interrupts.code()
        # Typer's usage errors: known by what they do, because their class moved between its versions.
        if hasattr(error, "format_message"):
            path = getattr(getattr(error, "ctx", None), "command_path", "meshgauge")
            text = command.in_plain_words(error.format_message())
            return failed(f"{text} (see '{path} --help')") if text else COULD_NOT  # the help was printed
        if os.environ.get(TRACEBACK):
            raise
        return failed(f"{terminal.unexpected(error)} (set {TRACEBACK}=1 for the traceback)")
    if interrupts.is_asked():  # which Typer takes for Ctrl-C, whatever it was
        return interrupts.code()
    return code if isinstance(code, int) else DONE


def failed(message: str) -> int:
    """Print in one line what could not be done; returns the exit code."""
    terminal.warn("error", message)
    return COULD_NOT


if __name__ == "__main__":
    sys.exit(main())
