"""What a user asks a prior for."""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from dreamdrive.errors import InputError
from dreamdrive.scene.control.kinds import (
    WITHOUT_SAYING,
    PhotoInput,
    RecordingInput,
    StreetInput,
    VideoModelInput,
    flag_of,
)

FILES = ("path", "intrinsics", "poses", "trajectory", "trajectories", "features", "weights")
"""Fields of ``Control`` that name files; they count by their content."""


@dataclass(frozen=True, kw_only=True)
class Control(RecordingInput, PhotoInput, StreetInput, VideoModelInput):
    """The input of a prior and how to read it; ``None`` leaves a choice to the prior."""

    def __post_init__(self) -> None:
        """Take strings for paths: who types them means files."""
        for name in FILES:
            if isinstance(given := getattr(self, name), str):
                object.__setattr__(self, name, Path(given))

    @property
    def settings(self) -> dict[str, Any]:
        """What counts by its value: all but the files and the seed."""
        return {k: v for k, v in asdict(self).items() if k not in (*FILES, "seed")}

    def check_taken(self, takes: frozenset[str], by: str) -> None:
        """Refuse what is given and not taken."""
        given = [field.name for field in fields(self) if getattr(self, field.name) is not None]
        if refused := [flag_of(name) for name in given if name not in takes | WITHOUT_SAYING]:
            taken = ", ".join(sorted({flag_of(name) for name in takes - {"path"}}))
            raise InputError(f"{by} takes no {' and no '.join(refused)}; it takes {taken}")
