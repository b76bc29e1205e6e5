"""From weights on disk to networks that can be asked, if there is the memory. Loads diffusers."""

from pathlib import Path

from dreamdrive.memory import best_device, free_bytes
from dreamdrive.prior.vista.kinds import Kind
from dreamdrive.prior.vista.memory import Plan, plan_memory
from dreamdrive.prior.vista.networks import Networks
from dreamdrive.prior.vista.stored import open_weights


def start(
    weights: Path, kind: Kind | None, size: tuple[int, int], frames: int | None
) -> tuple[Networks, Plan, int]:
    """Check weights and memory, without loading anything yet.

    Args:
        weights: File or folder.
        kind: Which model it must be; None takes both.
        size: Width and height of the frames.
        frames: How many there will be; None for as many as the UNet sees at once.

    Returns:
        The networks, what they will take, and how many frames the UNet sees at once.

    Raises:
        InputError: The weights cannot be used, or memory does not suffice.
    """
    stored = open_weights(weights, kind)
    device = best_device()
    half = device.type == "cuda"
    free = free_bytes(device)
    count = int(stored.parts["unet"].config.get("num_frames", 25))
    plan = plan_memory(stored, size, max(frames or 0, count), count, free, half=half)
    return Networks(stored, device, half=half), plan, count
