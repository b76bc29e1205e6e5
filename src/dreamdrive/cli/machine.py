"""What this machine offers, and its use."""

import os
import signal
from types import FrameType

from dreamdrive.machine import available_cores


def use_all_cores() -> None:
    """Let torch and the native core use every core of this process; to be called before torch is imported."""
    # By default threads that wait keep their core busy: beside other work a fit takes three times as long.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    import torch

    from dreamdrive.splat import set_threads

    torch.set_num_threads(available_cores())
    set_threads(available_cores())


class Terminated(KeyboardInterrupt):
    """Asked to terminate (SIGTERM), which ends the work as Ctrl-C does."""


def stop_like_an_interruption() -> None:
    """Let a request to terminate end the work as Ctrl-C does.

    To be called after pycolmap is imported: it installs a handler that prints the stack and dies.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        raise Terminated

    signal.signal(signal.SIGTERM, stop)
