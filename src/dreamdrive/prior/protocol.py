"""What every prior offers."""

from collections.abc import Callable
from dataclasses import dataclass

from dreamdrive.errors import InputError
from dreamdrive.models import Backend
from dreamdrive.prior.rollouts import rollouts_of, together
from dreamdrive.progress import Progress, Work, silent
from dreamdrive.scene.action import check_action
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control

Make = Callable[[Control, Progress], Clip]
"""F_VDM (eq. 3): from what the user asks for to frames with features Z_ref; InputError where it cannot."""
FASTEST_M_S = 60.0
"""Of traffic."""


@dataclass(frozen=True, kw_only=True)
class Prior(Backend):
    """A prior, by its name for ``--prior``.

    Attributes:
        make: The way itself.
        takes: Names of the fields of ``Control`` that it honours; ``seed`` and ``weights`` go without saying.
        gives: What its clips hold beside the frames, in words.
        of_street: Whether it is conditioned on a map: its input is a layout, or a scene of a data set, of
            which boxes, map, path and calibration count, and pictures do not.
    """

    make: Make
    takes: frozenset[str]
    gives: str
    of_street: bool = False

    def check(self, control: Control) -> None:
        """Whether it could start and honour all that is asked.

        Raises:
            InputError: A field is given that it does not take, that contradicts another or is outside its
                range, or weights or a package are missing.
        """
        control.check_taken(self.takes, f"the prior {self.name}")
        told = {
            "--trajectory": control.trajectory,
            "--trajectories": control.trajectories,
            "--action": control.action or control.actions,
        }
        if len(given := [flag for flag, value in told.items() if value]) > 1:
            raise InputError(f"{' and '.join(given)} both tell where to drive; give one of them")
        for action in (control.action, *(control.actions or ())):
            if action is not None:
                check_action(action)
        if control.steps is not None and control.steps < 1:
            raise InputError(f"--steps {control.steps}: expected 1 or more")
        if control.traffic_speed_m_s is not None and not 0 < control.traffic_speed_m_s <= FASTEST_M_S:
            raise InputError(
                f"--traffic-speed {control.traffic_speed_m_s:g}: expected metres a second, above 0 and at "
                f"most {FASTEST_M_S:g}"
            )
        if control.traffic == "still" and control.traffic_speed_m_s is not None:
            raise InputError("--traffic still and --traffic-speed exclude each other; give one of them")
        self.check_start("prior", control.weights)

    def __call__(self, control: Control, progress: Progress = silent) -> Clip:
        """Make the clip, of all drives that are asked for.

        Raises:
            InputError: See ``check``; or input, options or weights cannot be used.
        """
        self.check(control)
        rollouts, work = rollouts_of(control), Work(progress)
        return together(
            [self.make(each, work.part(number, len(rollouts))) for number, each in enumerate(rollouts)]
        )
