"""The entry of the command line: subcommands, exit codes, errors in one line."""

from __future__ import annotations

import errno
import os
import sys
from typing import Annotated

import typer

from ..errors import MeshgaugeError
from ..files import resources, sources
from ..files.standard import unwritten
from . import command, interrupts, streams, terminal
from .check import check
from .compare import compare
from .doctor import doctor
from .explain import explain
from .formats import formats
from .improve import improve
from .merge import merge
from .metrics import metrics
from .orient import orient
from .paraview import paraview_plugin
from .plot import plot
from .report import report
from .terminal import COULD_NOT, DONE, TRACEBACK
from .undo import undo
from .view import view

app = typer.Typer(
    name="meshgauge",
    help="Measure every cell of a 3D mesh, of every type, with one number.",
    epilog="Start with: [bold]meshgauge report MESH[/bold]",
    invoke_without_command=True,
    cls=command.Commands,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
_COMMANDS = (
    report,
    merge,
    check,
    compare,
    doctor,
    improve,
    orient,
    undo,
    plot,
    paraview_plugin,
    view,
    metrics,
    formats,
    explain,
)
for function in _COMMANDS:
    command.add(app, function)


def _version(asked: bool) -> None:
    if asked:
        from .._version import __version__

        typer.echo(f"meshgauge {__version__}")
        raise typer.Exit


@app.callback()
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
            code = app(args=arguments, prog_name="meshgauge", standalone_mode=False)
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
            command = getattr(getattr(error, "ctx", None), "command_path", "meshgauge")
            text = error.format_message()
            return failed(f"{text} (see '{command} --help')") if text else COULD_NOT  # the help was printed
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
