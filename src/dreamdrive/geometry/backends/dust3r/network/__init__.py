"""The network: weights from a file, frames to pictures, pictures to pointmaps of pairs."""

from dreamdrive.geometry.backends.dust3r.network.checkpoint import load_dust3r
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from dreamdrive.geometry.backends.dust3r.network.images import fitting
from dreamdrive.geometry.backends.dust3r.network.inference import BUDGET_BYTES, infer
from dreamdrive.geometry.backends.dust3r.network.memory import plan_memory
