"""Weights that come inside packages: only their files are used, none of their code is imported."""

from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.models import sha256


class MissingWeightsError(InputError):
    """Optional weights are not installed, or are others than those that figures are defined by."""


@dataclass(frozen=True)
class PackagedFile:
    """A file inside an installed package, its digest, and how to get it.

    With other weights a figure would be another.
    """

    package: str
    path: str
    sha256: str
    install: str

    def locate(self) -> Path:
        """Where the file is; MissingWeightsError where the package is missing or the file is another."""
        try:
            found = Path(str(metadata.distribution(self.package).locate_file(self.path)))
        except metadata.PackageNotFoundError:
            raise MissingWeightsError(f"{self.package} is not installed: {self.install}") from None
        if not found.is_file():
            raise MissingWeightsError(f"{found} of {self.package} is missing: {self.install}")
        if sha256(found) != self.sha256:
            raise MissingWeightsError(f"{found} is not the file this figure is defined by: {self.install}")
        return found

    def checked(self, path: Path) -> Path:
        """A copy of the file that lies elsewhere; InputError where it is unreadable or another."""
        got = sha256(path)
        if got != self.sha256:
            raise InputError(
                f"{path} has SHA-256 {got}, but the figure is defined by {self.path} of {self.package}, "
                f"{self.sha256}; take the file out of that package: {self.install}"
            )
        return path
