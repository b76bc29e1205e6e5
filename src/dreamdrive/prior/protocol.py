"""What every prior offers."""

from typing import Protocol, runtime_checkable

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control


@runtime_checkable
class Prior(Protocol):
    """F_VDM (eq. 3): from what the user asks for to frames with features Z_ref."""

    def __call__(self, control: Control) -> Clip:
        """Make the clip.

        Raises:
            InputError: The prior cannot work with this control.
        """
        ...
