"""Steps a second of DreamDrive-v0, with one camera, with three and with none.

A drawn street of four seconds becomes a scene of quality standard, once. An episode drives along it with
gentle actions; resets count, the first one of each kind does not, as it makes the scene ready. The best of
``--repeat`` rounds counts, as others may use the machine. The peer of each is a loop without the environment:
every picture of the recorded drive is a call of ``render_scene``.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from scipy.spatial.transform import Rotation

import dreamdrive.tasks.environment  # noqa: F401  (registers DreamDrive-v0)
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive.tasks.environment import mount
from dreamdrive_bench.common.machine import OthersWatch, add_threads, describe_machine, use_threads
from dreamdrive_bench.common.made import scene_of
from dreamdrive_bench.common.markdown import table
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from streetworld import make_street

_FRAMES, _RATE_HZ, _SIZE = 40, 10.0, (320, 192)
_TURNS_DEG: dict[str, tuple[float, ...]] = {"none": (), "one": (0.0,), "three": (55.0, 0.0, -55.0)}
"""How far to the left the cameras look."""
_PEER_STEPS = 20


def main() -> int:
    """Make the scene, drive, print the table."""
    parser = parser_of(__doc__, runs="runs/environment", markdown=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=150)
    parser.add_argument("--repeat", type=int, default=3)
    add_threads(parser)
    args = parser.parse_args()
    use_threads(args.threads)
    record = partial(make_street, args.seed, _FRAMES, _RATE_HZ, _SIZE)
    scene = scene_of(record, "standard", args.runs / f"street-{args.seed}")
    watch = OthersWatch()
    rows = [_row(name, scene, args.steps, args.repeat) for name in _TURNS_DEG]
    report = {"machine": describe_machine(), "others": watch.share(), "rows": rows}
    report |= {"standing": len(scene.static), "moving": len(scene.dynamic), "size_px": _SIZE}
    head = ["cameras", "ready after s", "steps/s", "render_scene, steps/s", "ratio"]
    return publish(args, report, table(head, [_line(row) for row in rows]) + "\n", ())


def _line(row: dict[str, Any]) -> list[str]:
    ours, peer = row["per_s"], row.get("peer_per_s")
    beside = ["", ""] if peer is None else [f"{peer:.1f}", f"{ours / peer:.1f}"]
    return [row["cameras"], f"{row['ready_s']:.1f}", f"{ours:.1f}", *beside]


def _row(name: str, scene: Scene, steps: int, repeat: int) -> dict[str, Any]:
    turns = _TURNS_DEG[name]
    cameras = [mount(f"{turn:g}", left_deg=turn, size_px=_SIZE) for turn in turns]
    made = gymnasium.make("DreamDrive-v0", scenes=scene, cameras=cameras)
    row: dict[str, Any] = {"cameras": name}
    began = time.perf_counter()
    made.reset(seed=0)
    row["ready_s"] = time.perf_counter() - began
    row["per_s"] = _best(partial(_drive, made, steps), steps, repeat)
    if turns:
        row["peer_per_s"] = _best(partial(_plain, scene, turns, _PEER_STEPS), _PEER_STEPS, repeat)
    return row


def _best(drive: Callable[[], None], steps: int, repeat: int) -> float:
    """Steps a second of the best round."""
    found: list[float] = []
    for _ in range(repeat):
        began = time.perf_counter()
        drive()
        found.append(steps / (time.perf_counter() - began))
    return max(found)


def _drive(made: gymnasium.Env[Any, Any], steps: int) -> None:
    rng = np.random.default_rng(0)
    made.reset(seed=0)
    for _ in range(steps):
        *_, terminated, truncated, _ = made.step(rng.uniform(-0.2, 0.2, 2).astype(np.float32))
        if terminated or truncated:
            made.reset()


def _plain(scene: Scene, turns_deg: Sequence[float], steps: int) -> None:
    """The pictures of the recorded drive, each as a call of its own."""
    pinhole = mount("any", size_px=_SIZE).pinhole
    turns = np.tile(np.eye(4), (len(turns_deg), 1, 1))
    turns[:, :3, :3] = Rotation.from_rotvec(
        np.outer(-np.array(turns_deg), [0, 1, 0]), degrees=True
    ).as_matrix()
    times_s = np.linspace(0, scene.times_s.max(), steps)
    for t_s, pose in zip(times_s.tolist(), scene.trajectory.at(times_s), strict=True):
        for turn in turns:
            render_scene(scene, pinhole.at(pose @ turn), t_s).picture  # noqa: B018
