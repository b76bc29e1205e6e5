"""Milliseconds of one training step, stage by stage, and the same step in plain torch.

The step is the trainer's own, on a street of Gaussians of which a tenth go through the deformation field. A
time is the mean over ten steps; the best of ``--repeat`` rounds counts, as others may use the machine. The
split is torch's profile of the step in the same rounds: each stage's own share, backward by the forward stage
it belongs to. The peer is the step written with plain torch (torch.optim.Adam, SSIM by conv2d;
``plain_step``) around the same splat, with one torch thread and with as many as the machine has, in turn
with ours.
"""

import functools
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from unittest.mock import patch

import torch

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.fit import ExposureNetwork, Model, Parameters, Trainer, trainer as trainer_module
from dreamdrive.motion import deformation as deformation_module
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive_bench.common.machine import add_threads, describe_machine, use_threads
from dreamdrive_bench.common.options import parser_of, size_of
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.splat.fit_scene import FIRST_STEP, OPTIONS, FitScene, make
from dreamdrive_bench.splat.plain_step import PlainTrainer

STEPS = 10  # of one round; one of them looks at the shapes
# Whose calls are timed, and as what.
STAGES = [
    (Model, "moved", "living dynamic rows"),
    (deformation_module, "network_residual", "deformation network"),
    (deformation_module.DeformationField, "pose", "tracks"),
    (deformation_module, "posed", "tracks and life spans"),
    (Gaussians, "alive_at", "tracks and life spans"),
    (trainer_module, "activate", "activations"),
    (trainer_module, "_splat", "splat"),
    (ExposureNetwork, "forward", "exposure network"),
    (trainer_module, "recorded_picture", "sky and exposure"),
    (trainer_module, "render_loss", "L1 + SSIM"),
    (trainer_module, "geometry_loss", "depth and coverage losses"),
    (trainer_module, "_step", "Adam of the networks"),
    (Parameters, "step", "Adam of the Gaussians"),
    (Trainer, "_observe", "densification statistics"),
    (torch.Tensor, "backward", "backward"),
]
REST = "the rest"


def step_ms(step: Callable[[int], None]) -> float:
    """Mean of the steps of one round."""
    start = time.perf_counter()
    for index in range(STEPS):
        step(index)
    return 1e3 * (time.perf_counter() - start) / STEPS


def labelled(function: Callable[..., object], label: str) -> Callable[..., object]:
    """The function, seen by the profiler under a name."""

    @functools.wraps(function)
    def wrapper(*arguments: object, **named: object) -> object:
        with torch.profiler.record_function(f"stage: {label}"):
            return function(*arguments, **named)

    return wrapper


def stage_of(event: torch.autograd.profiler_util.FunctionEvent) -> str:
    """The innermost stage an event lies in."""
    while event is not None and not event.name.startswith("stage: "):
        event = event.cpu_parent
    return REST if event is None else event.name.removeprefix("stage: ")


def profile(step: Callable[[int], None]) -> dict[tuple[str, str], float]:
    """Microseconds of one round by stage and by "forward" or "backward"."""
    with ExitStack() as stack:
        for owner, name, label in STAGES:
            stack.enter_context(patch.object(owner, name, labelled(getattr(owner, name), label)))
        with torch.profiler.profile(activities=[torch.profiler.ProfilerActivity.CPU]) as profiler:
            start = time.perf_counter()
            for index in range(STEPS):
                step(index)
            whole = 1e6 * (time.perf_counter() - start)
    events = sorted(profiler.events(), key=lambda event: event.time_range.start)
    spent: dict[tuple[str, str], float] = defaultdict(float)
    maker: dict[int, str] = {}  # stage that made the backward node of a number
    for event in events:
        taken = event.time_range.elapsed_us()
        if event.name.startswith("stage: "):
            spent[stage_of(event), "forward"] += taken
            parent = stage_of(event.cpu_parent)
            spent[parent, "forward"] -= taken if parent != REST else 0.0
        elif event.name.startswith("autograd::engine::evaluate_function: "):
            accumulates = event.name.endswith("AccumulateGrad")
            stage = "gradients kept" if accumulates else maker.get(event.sequence_nr, REST)
            spent[stage, "backward"] += taken
            spent["backward", "forward"] -= taken
        elif event.sequence_nr is not None and event.sequence_nr >= 0 and stage_of(event) != "backward":
            maker[event.sequence_nr] = stage_of(event)
    # What is left of "backward" is the engine itself.
    spent["autograd engine", "backward"] = spent.pop(("backward", "forward"))
    spent[REST, "forward"] = whole - sum(spent.values())
    return dict(spent)


def split_ms(rounds: list[dict[tuple[str, str], float]], whole_ms: float) -> list[dict[str, object]]:
    """Milliseconds by stage, largest first: shares of the least seen of each, of ``whole_ms``."""
    least = {key: min(found.get(key, 0.0) for found in rounds) for key in rounds[0]}
    scale = whole_ms / sum(least.values())
    rows = []
    for stage in {stage for stage, _ in least}:
        forward, backward = (scale * least.get((stage, way), 0.0) for way in ("forward", "backward"))
        rows.append({"stage": stage, "forward_ms": forward, "backward_ms": backward})
    return sorted(rows, key=lambda row: -row["forward_ms"] - row["backward_ms"])


def steps_of(scene: FitScene, trainer: Trainer | PlainTrainer) -> Callable[[int], None]:
    """Takes the step of a round."""
    sky = scene.sky.colour(scene.views[0].camera).contiguous()
    return lambda index: trainer.step(FIRST_STEP + index, scene.views[index], sky)


def print_table(report: dict[str, object]) -> None:
    """What was measured, for people."""
    whole = report["step_ms"]
    machine = f"{report['machine']['isa']}, {report['machine']['threads']} threads"
    print(f"{report['gaussians']} Gaussians, {report['size']}, {report['source']}, {machine}")
    print(f"\n{'stage':<28}{'forward ms':>12}{'backward ms':>13}{'share':>8}")
    for row in report["stages"]:
        share = (row["forward_ms"] + row["backward_ms"]) / whole
        print(f"{row['stage']:<28}{row['forward_ms']:>12.2f}{row['backward_ms']:>13.2f}{share:>8.1%}")
    print(f"{'step':<28}{whole:>12.2f} ms{1e3 / whole:>17.1f} steps/s")
    for peer in report["peers"]:
        print(f"{peer['name']:<28}{peer['step_ms']:>12.2f} ms{peer['ratio']:>14.2f} times as long")


def main() -> None:
    """Measure the step and its peer."""
    parser = parser_of(__doc__)
    add_threads(parser)
    parser.add_argument("--gaussians", type=int, default=100_000, metavar="N")
    parser.add_argument("--size", type=size_of, default=(480, 270), metavar="WxH")
    parser.add_argument("--repeat", type=int, default=5, metavar="N", help="rounds the best is taken of")
    options = parser.parse_args()
    use_threads(options.threads)
    scene = make(*options.size, options.gaussians)
    ours = steps_of(scene, scene.trainer())
    plain = steps_of(scene, PlainTrainer(scene.model(), OPTIONS))
    runs = {
        "step": (ours, one_torch_thread),
        "plain torch, 1 thread": (plain, one_torch_thread),
        f"plain torch, {torch.get_num_threads()} threads": (plain, nullcontext),
    }
    times: dict[str, list[float]] = {name: [] for name in runs}
    profiles = []
    for index in range(options.repeat + 1):
        for name, (step, threads) in runs.items():
            with threads():
                times[name].append(step_ms(step))
        with one_torch_thread():
            profiles.append(profile(ours))
        if index == 0:  # to warm up
            times, profiles = {name: [] for name in runs}, []
    best = {name: min(taken) for name, taken in times.items()}
    whole = best.pop("step")
    peers = [{"name": name, "step_ms": taken, "ratio": taken / whole} for name, taken in best.items()]
    report = {
        "gaussians": options.gaussians,
        "size": "{}x{}".format(*options.size),
        "source": scene.source,
        "step_ms": whole,
        "steps_per_s": 1e3 / whole,
        "stages": split_ms(profiles, whole),
        "peers": peers,
        "machine": describe_machine(),
    }
    print_table(report)
    write(options.json, as_json(report))
