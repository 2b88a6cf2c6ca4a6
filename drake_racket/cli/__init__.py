"""The command line is `drake-racket`; each module here is one command.

Units: m/s, degrees, s. Bad input prints one line on standard error and exits with status 2.
"""

from __future__ import annotations

import gc
import io
import sys
from typing import Annotated, Any, NoReturn

import typer

from drake_racket.cli import animate, cite, examples, identify, impact, plot, show, sweep, validate
from drake_racket.cli.rackets import compare, customise, new
from drake_racket.io.errors import InputError, SimulationError, WorkStopped, one_line
from drake_racket.io.interrupts import exit_status, terminable

app = typer.Typer(
    pretty_exceptions_enable=False,
    help="Tennis racket and ball impacts, after Glynn, King & Mitchell (2011).",
)
for command in (
    impact.impact,
    new.new,
    customise.customise,
    compare.compare,
    plot.plot,
    animate.animate,
    sweep.sweep,
    show.show,
    validate.validate,
    examples.examples,
    cite.cite,
):
    app.command()(command)
app.add_typer(identify.app, name="identify")


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"drake-racket {version('drake-racket')}, Drake {version('drake')}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            is_eager=True,
            callback=_print_version,
            help="Print the versions of the package and of Drake.",
        ),
    ] = False,
) -> None:
    """Tennis racket and ball impacts, after Glynn, King & Mitchell (2011)."""


# click's class for wrong options and arguments; typer carries its own copy or imports click
_UsageError: Any = typer.BadParameter.__bases__[0]


def main() -> None:
    """Runs the command line; bad input ends with status 2 and one line on standard error."""
    # imports leave many objects that stay: to look through them for garbage takes 0.4 s
    gc.set_threshold(50_000, 20, 100)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal without ° or ² gets ? instead
    with terminable() as terminated:
        status = _run()
    if status:
        sys.exit(exit_status(terminated[-1]) if terminated else status)


def _run() -> int | None:
    try:
        status: int | None = app(sys.argv[1:] or ["--help"], standalone_mode=False)
    except InputError as error:
        _stop(str(error), 2)
    except _UsageError as error:
        _stop(f"{error.format_message()} (see drake-racket --help)", 2)
    except (SimulationError, WorkStopped) as error:
        _stop(str(error), 1)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(1)
    except (typer.Abort, KeyboardInterrupt):  # where a command, or typer, gives it no status
        return 130
    return status


def _stop(message: str, status: int) -> NoReturn:
    print(f"drake-racket: {one_line(message)}", file=sys.stderr)
    sys.exit(status)
