"""Entry point of ``dreamdrive``."""

import errno
import gc
import io
import logging
import os
import sys
from collections.abc import Callable
from importlib.util import find_spec
from typing import cast

import tyro
from rich.console import Console
from rich.logging import RichHandler

import dreamdrive
from dreamdrive.cli.clean import clean
from dreamdrive.cli.data import data
from dreamdrive.cli.dataset import dataset
from dreamdrive.cli.doctor import doctor
from dreamdrive.cli.editing.actors import actors
from dreamdrive.cli.editing.edit import edit
from dreamdrive.cli.evaluate import evaluate
from dreamdrive.cli.export import export
from dreamdrive.cli.generate import generate
from dreamdrive.cli.import_splats import import_splats
from dreamdrive.cli.look import look
from dreamdrive.cli.plan import plan
from dreamdrive.cli.prior import prior
from dreamdrive.cli.render import render
from dreamdrive.cli.terminal.arguments import REGISTRY
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import Terminated, asked_to_end, stop_like_an_interruption
from dreamdrive.cli.view import view
from dreamdrive.errors import InputError
from dreamdrive.registry import loaded

COMMANDS = {
    "generate": generate,
    "look": look,
    "view": view,
    "render": render,
    "actors": actors,
    "edit": edit,
    "plan": plan,
    "export": export,
    "import": import_splats,
    "clean": clean,
    "evaluate": evaluate,
    "data": data,
    "dataset": dataset,
    "prior": prior,
    "doctor": doctor,
}
OTHERS = {"world": "streetworld.cli:world", "train": "dreamdrive_train.cli:train"}
"""Commands of the products beside dreamdrive, each there if its package is."""
_USER_ERROR, _INTERRUPTED, _TERMINATED = 2, 130, 143
_GARBAGE = 50_000  # objects made, of those that may hold one another, until somebody looks for garbage
# What the machine may refuse without anything being wrong with the program.
_NO_MEMORY = "Insufficient memory", "can't allocate memory", "CUDA out of memory"
_REFUSALS = {
    errno.ENOSPC: "free some space, or choose a folder on another disk",
    errno.EDQUOT: "free some of your quota, or choose a folder on another disk",
    errno.EACCES: "check the permissions, or choose another folder",
    errno.EPERM: "check the permissions, or choose another folder",
    errno.EROFS: "choose a folder on a disk that can be written to",
    errno.ENOTDIR: "choose another folder",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def main() -> None:
    """Run the command that the arguments name and exit with its status.

    Exit codes: 0 done, 2 the user's mistake (the message alone on stderr), 130 interrupted, 143 terminated.
    """
    errors = plain(stderr=True)
    # What is imported stays: to look through it for garbage again and again, and once more at the end, takes
    # a second of three.
    gc.set_threshold(_GARBAGE)
    try:
        try:
            _run(errors)
        except Exception:
            if (asked := asked_to_end()) is not None:  # what is written in C may make another error of it
                raise asked from None
            raise
        finally:
            sys.stdout.flush()
    except BrokenPipeError:  # nobody reads on, as behind ``| head``
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except InputError as error:
        errors.print(f"error: {error}")
        sys.exit(_USER_ERROR)
    except KeyboardInterrupt as error:
        asked_to_end()
        errors.print("interrupted: finished stages are kept, and the same command goes on from there")
        sys.exit(_TERMINATED if isinstance(error, Terminated) else _INTERRUPTED)
    except OSError as error:
        if error.errno not in _REFUSALS:
            raise
        where = f" ({error.filename})" if error.filename else ""
        errors.print(f"error: {error.strerror}{where}; {_REFUSALS[error.errno]}")
        sys.exit(_USER_ERROR)
    except Exception as error:
        if not _out_of_memory(error):
            raise
        errors.print("error: memory is used up; choose fewer frames with --frames, or a smaller --size")
        sys.exit(_USER_ERROR)
    finally:
        gc.freeze()


def _run(errors: Console) -> None:
    stop_like_an_interruption()
    for stream in (sys.stdout, sys.stderr):
        # What a terminal cannot show is shown as a question mark: better than to fail behind the work.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    if sys.argv[1:] == ["--version"]:
        plain().print(f"dreamdrive {dreamdrive.__version__}")
        return
    said = RichHandler(console=errors, show_time=False, show_path=False)
    logging.basicConfig(level="WARNING", format="%(message)s", handlers=[said])
    tyro.extras.subcommand_cli_from_dict(
        {**COMMANDS, **_others(sys.argv[1:2])},
        prog="dreamdrive",
        description=(dreamdrive.__doc__ or "").partition("\n")[0],
        config=(tyro.conf.DisallowNone, tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff),
        registry=REGISTRY,
    )


def _others(wanted: list[str]) -> dict[str, Callable[..., None]]:
    """The commands of other products that are installed."""
    found: dict[str, Callable[..., None]] = {}
    for name, place in OTHERS.items():
        package = place.partition(".")[0]
        if find_spec(package) is not None:
            found[name] = cast("Callable[..., None]", loaded(place))
        elif wanted == [name]:
            raise InputError(
                f"dreamdrive {name} needs the package {package}; install it from packages/{package}"
            )
    return found


def _out_of_memory(error: Exception) -> bool:
    """Whether Python, or the allocator of OpenCV or PyTorch, got no more memory."""
    return isinstance(error, MemoryError) or any(words in str(error) for words in _NO_MEMORY)
