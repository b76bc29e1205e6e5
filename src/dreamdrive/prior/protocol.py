"""What every prior offers."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.input import log_of
from dreamdrive.data.planned import Planned
from dreamdrive.datasets.logs import choose_shots, files_of, told_of_street
from dreamdrive.errors import InputError
from dreamdrive.files.digest import digest, file_digest
from dreamdrive.models import Backend
from dreamdrive.prior.rollouts import rollouts_of, together
from dreamdrive.progress import Progress, Work, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control, check_action
from dreamdrive.scene.street.log import Log
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.street_network import SHIPPED

Make = Callable[..., Clip]
"""F_VDM (eq. 3): from ``(Input, Progress)``, and ``Seeing`` for priors that look, to frames with features
Z_ref; InputError where it cannot."""
Truth = Callable[[Path, Int[np.ndarray, " f"], Float[np.ndarray, " f"], tuple[int, int]], DriveTruth]
"""From a layout's file, indices and times of frames, width and height to the drive that they are of."""
FASTEST_M_S = 60.0
"""Of traffic."""


@dataclass(frozen=True)
class Seeing:
    """How a prior that looks sees its input: as the geometry will.

    Attributes:
        knowledge: Weights of the street network: the name of those that ship, a file, or ``"none"``.
        camera_height_m: Height of the camera above the road; None where nobody tells.
    """

    knowledge: str = SHIPPED
    camera_height_m: float | None = None


@dataclass(frozen=True)
class Input:
    """What a prior makes frames from, opened once for all that is asked of it.

    Attributes:
        prior: The prior that opened it.
        control: The input, and how to read it.
        log: The drive, of a data set that has drives with labels; else None.
    """

    prior: "Prior"
    control: Control
    log: Log | None

    @property
    def plan(self) -> Planned | None:
        """What a run will work on; None where that is unknown before the frames are read."""
        return self.prior.plan(self)

    @cached_property
    def digest(self) -> str | None:
        """Of what the prior sees of a drive; None where the input is none, and its files decide.

        Those are its pictures and what is known of them, or, for priors that are conditioned on a map, its
        boxes, map, path and calibration.
        """
        if self.log is None:
            return None
        if self.prior.of_street:
            return digest(told_of_street(self.log))
        files, told = files_of(choose_shots(self.log, self.control.cameras, self.control.frames))
        return digest([told, [file_digest(file) for file in files]])

    def clip(self, progress: Progress = silent, seeing: Seeing = Seeing()) -> Clip:
        """The frames, of all drives that are asked for.

        Raises:
            InputError: Input, options or weights cannot be used.
        """
        rollouts, work = rollouts_of(self.control), Work(progress)
        how = (seeing,) if self.prior.looks else ()
        each = [replace(self, control=control) for control in rollouts]
        return together(
            [self.prior.make(one, work.part(number, len(each)), *how) for number, one in enumerate(each)]
        )


@dataclass(frozen=True, kw_only=True)
class Prior(Backend):
    """A prior, by its name for ``--prior``.

    Attributes:
        make: The way itself.
        takes: Names of the fields of ``Control`` that it honours; ``seed`` and ``weights`` go without saying.
        gives: What its clips hold beside the frames, in words.
        looks: Whether the street network sees its input for it, in metres.
        recorded: Whether its frames are the input's own, so that the camera may have hung upside down.
        of_street: Whether it is conditioned on a map: its input is a layout, or a scene of a data set, of
            which boxes, map, path and calibration count, and pictures do not.
        plan: What a run will work on, told before frames are read; None where that is unknown.
        truth: What is known exactly of the frames that it makes of a layout, for priors that draw them.
    """

    make: Make
    takes: frozenset[str]
    gives: str
    looks: bool = False
    recorded: bool = False
    of_street: bool = False
    plan: Callable[[Input], Planned | None] = lambda opened: None
    truth: Truth | None = None

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

    def open(self, control: Control) -> Input:
        """The input of a control.

        Raises:
            InputError: See ``check``; or the input cannot be opened.
        """
        self.check(control)
        return Input(self, control, log_of(control))

    def __call__(self, control: Control, progress: Progress = silent, seeing: Seeing = Seeing()) -> Clip:
        """Open the input and make the clip, see ``Input.clip``."""
        return self.open(control).clip(progress, seeing)
