"""From weights on disk to networks that can be asked, if there is the memory. Loads diffusers."""

from pathlib import Path

from dreamdrive.device import chosen_device
from dreamdrive.machine import free_bytes
from dreamdrive.prior.vista.kinds import Kind
from dreamdrive.prior.vista.memory import Free, Job, check_memory
from dreamdrive.prior.vista.networks import Networks
from dreamdrive.prior.vista.stored import open_weights


def open_networks(weights: Path, kind: Kind | None) -> Networks:
    """Check weights of a kind, or of any, without loading; on a GPU the UNet will compute in float16."""
    device = chosen_device()
    return Networks(open_weights(weights, kind), device, half=device.type == "cuda")


def check_fit(networks: Networks, job: Job) -> None:
    """Whether there is memory for a job, before anything is loaded."""
    shared = networks.device.type != "cuda"
    free = Free(free_bytes(networks.device), None if shared else free_bytes(), shared=shared)
    check_memory(networks.stored, job, free, half=networks.half)
