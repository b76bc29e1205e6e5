"""One run at a time in a folder."""

from collections.abc import Generator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from dreamdrive.files.lock import locked
from dreamdrive.files.output import made_folder, tidy_temporary
from dreamdrive.files.undisturbed import held

NAME = ".dreamdrive.lock"
"""The file that is locked; it goes away with the run, and what a killed run leaves of it hinders nobody."""


@contextmanager
def only_run(out: Path) -> Generator[None, None, None]:
    """Keep other runs out of a folder; the kernel lets go of it however this process ends.

    Where another run works there, ``InputError`` names its process. The folder is made if need be, and
    removed at the end where nothing came into it.
    """

    def enter(stack: ExitStack) -> None:
        stack.enter_context(made_folder(out))
        stack.enter_context(locked(out / NAME, out))
        # What goes on where a killed run stopped may need no temporary folder itself.
        with suppress(OSError):
            tidy_temporary()

    with held(enter):
        yield
