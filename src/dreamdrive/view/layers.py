"""What can be shown of a scene from anywhere at any time: a table, and what its entries draw from."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from dreamdrive.run import is_kept, kept_scores
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.show import Image, Scored, depth_colours, score_colours, score_image, trust_colours
from dreamdrive.splat import Moment, Part, SceneView, moment_of, render_scene
from dreamdrive.trust import SceneTrust


@dataclass
class Kept:
    """What the run of a scene keeps beside it, read when it is asked for first."""

    stages: Path

    @property
    def has_scores(self) -> bool:
        """Whether there are dynamic scores, as far as can be told without reading them."""
        return is_kept(self.stages, "static") and is_kept(self.stages, "score")

    @cached_property
    def scores(self) -> Scored | None:
        """The dynamic scores; ``InputError`` where they cannot be used."""
        return kept_scores(self.stages)


@dataclass
class Looking:
    """Renders scenes for one browser; while neither scene nor time changes, the moment stays."""

    kept: Kept
    _of: tuple[object, ...] = field(default=(), init=False)
    _moment: Moment | None = field(default=None, init=False)
    _trust: SceneTrust | None = field(default=None, init=False)

    def at(self, scene: Scene, camera: Camera, t_s: float, part: Part = "all") -> SceneView:
        """What a camera sees."""
        of = (scene, t_s, part)
        same = len(self._of) == len(of) and self._of[0] is scene and self._of[1:] == of[1:]
        if self._moment is None or not same:
            self._of, self._moment = of, moment_of(scene, t_s, part)
        return render_scene(scene, camera, t_s, part=part, moment=self._moment)

    def trust(self, scene: Scene) -> SceneTrust:
        """What is known of the recorded views, which takes seconds for each other scene."""
        if self._trust is None or self._trust.scene is not scene:
            self._trust = SceneTrust.of(scene)
        return self._trust


Draw = Callable[[Looking, Scene, Camera, float], Image]
"""A picture of a scene, by a camera at a time."""


@dataclass(frozen=True)
class Layer:
    """An entry of the table: how it is drawn, and of which scenes it can be."""

    draw: Draw
    offered: Callable[[Scene, Kept], bool] = lambda scene, kept: True


def _colour(looking: Looking, scene: Scene, camera: Camera, t_s: float) -> Image:
    return looking.at(scene, camera, t_s).picture


def _depth(looking: Looking, scene: Scene, camera: Camera, t_s: float) -> Image:
    return depth_colours(looking.at(scene, camera, t_s).depth_m.numpy())


def _static(looking: Looking, scene: Scene, camera: Camera, t_s: float) -> Image:
    return looking.at(scene, camera, t_s, "static").picture


def _dynamic(looking: Looking, scene: Scene, camera: Camera, t_s: float) -> Image:
    return looking.at(scene, camera, t_s, "dynamic").picture


def _scores(looking: Looking, scene: Scene, camera: Camera, t_s: float) -> Image:
    """Those of the seeds of the frames around the time, before anything was told apart."""
    scored = looking.kept.scores
    if scored is None:
        return np.zeros((camera.height_px, camera.width_px, 3), np.uint8)
    nearest = np.argsort(np.abs(scene.times_s - t_s), kind="stable")[:3].tolist()
    return score_colours(score_image(scored, camera, nearest).numpy())


def _trust(looking: Looking, scene: Scene, camera: Camera, t_s: float) -> Image:
    seen = looking.trust(scene).view(camera, t_s)
    return trust_colours(seen.view.picture, seen.trust)


LAYERS: dict[str, Layer] = {
    "colour": Layer(_colour),
    "depth": Layer(_depth),
    "static": Layer(_static),
    "dynamic": Layer(_dynamic, lambda scene, kept: len(scene.dynamic) > 0),
    "trust": Layer(_trust, lambda scene, kept: scene.residual is not None),
    "scores": Layer(_scores, lambda scene, kept: kept.has_scores),
}
"""What the page offers, in its order."""


def layers_of(scene: Scene, kept: Kept) -> tuple[str, ...]:
    """The names of the layers that a scene has."""
    return tuple(name for name, layer in LAYERS.items() if layer.offered(scene, kept))
