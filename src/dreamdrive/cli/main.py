"""Entry point of ``dreamdrive``."""

import errno
import io
import logging
import sys

import tyro
from rich.console import Console
from rich.logging import RichHandler

import dreamdrive
from dreamdrive.cli.arguments import REGISTRY
from dreamdrive.cli.clean import clean
from dreamdrive.cli.data import data
from dreamdrive.cli.dataset import dataset
from dreamdrive.cli.doctor import doctor
from dreamdrive.cli.evaluate import evaluate
from dreamdrive.cli.export import export
from dreamdrive.cli.generate import generate
from dreamdrive.cli.look import look
from dreamdrive.cli.machine import Terminated, stop_like_an_interruption
from dreamdrive.cli.plan import plan
from dreamdrive.cli.prior import prior
from dreamdrive.cli.render import render
from dreamdrive.cli.train import train
from dreamdrive.cli.world import world
from dreamdrive.errors import InputError

COMMANDS = {
    "generate": generate,
    "look": look,
    "render": render,
    "plan": plan,
    "export": export,
    "clean": clean,
    "evaluate": evaluate,
    "data": data,
    "dataset": dataset,
    "world": world,
    "prior": prior,
    "train": train,
    "doctor": doctor,
}
_USER_ERROR, _INTERRUPTED, _TERMINATED = 2, 130, 143
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
    stop_like_an_interruption()
    for stream in (sys.stdout, sys.stderr):
        # What a terminal cannot show is shown as a question mark: better than to fail behind the work.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    errors = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    if sys.argv[1:] == ["--version"]:
        Console(highlight=False).print(f"dreamdrive {dreamdrive.__version__}")
        return
    logging.basicConfig(level="WARNING", format="%(message)s", handlers=[RichHandler(console=errors)])
    try:
        tyro.extras.subcommand_cli_from_dict(
            COMMANDS,
            prog="dreamdrive",
            description=dreamdrive.__doc__,
            config=(tyro.conf.DisallowNone, tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff),
            registry=REGISTRY,
        )
    except InputError as error:
        errors.print(f"error: {error}")
        sys.exit(_USER_ERROR)
    except KeyboardInterrupt as error:
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


def _out_of_memory(error: Exception) -> bool:
    """Whether Python, or the allocator of OpenCV or PyTorch, got no more memory."""
    return isinstance(error, MemoryError) or any(words in str(error) for words in _NO_MEMORY)
