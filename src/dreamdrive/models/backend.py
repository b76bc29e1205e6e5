"""Entries of tables of exchangeable methods: a name, and what each takes to start."""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from dreamdrive.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Backend:
    """A way of doing a stage's work, and what it takes.

    Attributes:
        name: For the command line.
        about: What it is, for people.
        licence: Of the code that is installed for it, and of the weights.
        memory: What it needs beyond the clip, in words.
        weights: Which weights it takes; None without a network.
        package: The module that has to be importable; None where nothing more is installed.
        install: How to get that package.
    """

    name: str
    about: str
    licence: str
    memory: str
    weights: str | None = None
    package: str | None = None
    install: str | None = None

    def missing_package(self) -> str | None:
        """What to install, in words; None where nothing is missing."""
        if self.package is None or find_spec(self.package) is not None:
            return None
        return f"the package {self.package} is missing: {self.install}"

    def check_start(self, stage: str, weights: Path | None) -> None:
        """Whether it could start; ``stage`` is which one it does, for messages.

        Raises:
            InputError: Weights or the package are missing, or weights are given to what has no network.
        """
        if self.weights is None and weights is None:
            return
        if self.weights is None:
            raise InputError(f"{stage} {self.name} has no network and takes no weights; got {weights}")
        if weights is None:
            raise InputError(
                f"{stage} {self.name} needs --weights PATH, {self.weights} (licence: {self.licence})"
            )
        if (missing := self.missing_package()) is not None:
            raise InputError(f"{stage} {self.name}: {missing}")
