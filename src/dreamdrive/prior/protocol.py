"""What every prior offers."""

from collections.abc import Callable
from dataclasses import dataclass

from dreamdrive.errors import InputError
from dreamdrive.models import Backend
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.action import check_action
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control

Make = Callable[[Control, Progress], Clip]
"""F_VDM (eq. 3): from what the user asks for to frames with features Z_ref; InputError where it cannot."""


@dataclass(frozen=True, kw_only=True)
class Prior(Backend):
    """A prior, by its name for ``--prior``.

    Attributes:
        make: The way itself.
        takes: Names of the fields of ``Control`` that it honours; ``seed`` and ``weights`` go without saying.
        gives: What its clips hold beside the frames, in words.
    """

    make: Make
    takes: frozenset[str]
    gives: str

    def check(self, control: Control) -> None:
        """Whether it could start and honour all that is asked.

        Raises:
            InputError: A field is given that it does not take, that contradicts another or is outside its
                range, or weights or a package are missing.
        """
        control.check_taken(self.takes, f"the prior {self.name}")
        if control.trajectory is not None and control.action is not None:
            raise InputError("--trajectory and --action both tell where to drive; give one of them")
        if control.action is not None:
            check_action(control.action)
        if control.steps is not None and control.steps < 1:
            raise InputError(f"--steps {control.steps}: expected 1 or more")
        self.check_start("prior", control.weights)

    def __call__(self, control: Control, progress: Progress = silent) -> Clip:
        """Make the clip; InputError as of ``check``, or where input, options or weights cannot be used."""
        self.check(control)
        return self.make(control, progress)
