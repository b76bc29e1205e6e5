"""A policy that learns to keep its lane in a generated scene.

    python examples/02_closed_loop.py [--out DIR]

A small drawn street becomes a scene, as a draft. `DreamDrive-v0` then drives in it: the policy sees numbers
alone, which takes half a millisecond a step, and ten weights are found by the cross-entropy method: draw
many, keep the best, draw around them. At the end the learned drive is shown through the front camera.

Half a minute on two cores, most of it for the scene.
"""

import argparse
from pathlib import Path

import gymnasium
import numpy as np

import dreamdrive.tasks.environment  # noqa: F401  (registers DreamDrive-v0)
from dreamdrive import Control, generate
from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.show import write_png
from dreamdrive.tasks.environment import NAMES, EgoOptions, EnvironmentOptions, StartOptions

SEEN = [NAMES.index(name) for name in ("aside_m", "turned_rad", "route_10_y_m", "speed_m_s")]
SCALE = np.array([1.0, 0.2, 1.0, 10.0])
WEIGHTS = 2 * (len(SEEN) + 1)
"""Of what is seen and of a constant, for the pedals and for the steering wheel."""
OPTIONS = EnvironmentOptions(
    max_steps=20,
    ego=EgoOptions(top_speed_m_s=10.0),
    start=StartOptions(share=(0.0, 0.3), aside_m=0.7, turned_rad=0.05),
)
"""Two seconds in a town, from a place beside the recorded one."""


def main() -> None:
    """Make a scene, learn, and show what was learned."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--out", type=Path, default=Path("out/02_closed_loop"))
    out = arguments.parse_args().out

    control = Control(frames="0:30:1", size=(160, 96), seed=3)
    generate(control, out, prior="street-world", options="draft", progress=show)
    print()

    env = gymnasium.make("DreamDrive-v0", scenes=out, cameras=(), options=OPTIONS)
    rng = np.random.default_rng(0)
    mean, spread = np.zeros(WEIGHTS), np.ones(WEIGHTS)
    before = score(env, mean, range(1000, 1020))
    for generation in range(10):
        drawn = mean + spread * rng.normal(size=(24, WEIGHTS))
        # All are judged by the same starts, which are others in each generation.
        seeds = range(4 * generation, 4 * generation + 4)
        returns = np.array([score(env, weights, seeds) for weights in drawn])
        best = drawn[np.argsort(returns)[-8:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.02
        print(f"generation {generation + 1}: {returns.mean():.1f} in the mean, {returns.max():.1f} the best")
    after = score(env, mean, range(1000, 1020))
    print(f"return over 20 other starts: {before:.1f} before, {after:.1f} after")
    env.close()

    frames = film(out, mean)
    write_video(out.parent / f"{out.name}_learned.mp4", frames, fps=10)
    write_png(out.parent / f"{out.name}_learned.png", frames[len(frames) // 2])
    print(f"the learned drive is in {out.parent / f'{out.name}_learned.mp4'}, and a picture of it beside")


def policy(weights: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Acceleration and steering, linear in what is seen."""
    seen = np.append(vector[SEEN] / SCALE, 1.0)
    return np.tanh(weights.reshape(2, -1) @ seen).astype(np.float32)


def score(env: gymnasium.Env, weights: np.ndarray, seeds: range) -> float:
    """The mean return of episodes."""
    total = 0.0
    for seed in seeds:
        observation, _ = env.reset(seed=seed)
        over = False
        while not over:
            observation, reward, terminated, truncated, _ = env.step(policy(weights, observation["vector"]))
            total += reward
            over = terminated or truncated
    return total / len(seeds)


def film(scene: Path, weights: np.ndarray) -> list[np.ndarray]:
    """The drive of a policy from a place beside the path: the front camera, and the street from above."""
    env = gymnasium.make(
        "DreamDrive-v0", scenes=scene, size_px=(534, 320), render_mode="above", options=OPTIONS
    )
    observation, _ = env.reset(seed=0, options={"start_s": 0.0, "aside_m": 0.7, "turned_rad": 0.05})
    frames, over = [], False
    while not over:
        observation, _, terminated, truncated, _ = env.step(policy(weights, observation["vector"]))
        frames.append(np.concatenate([observation["camera"][0], env.render()], axis=1))
        over = terminated or truncated
    env.close()
    return frames


def show(stage: str, done: int, total: int) -> None:
    """One line a stage."""
    if total and done == total:
        print(stage, end=" ", flush=True)


if __name__ == "__main__":
    main()
