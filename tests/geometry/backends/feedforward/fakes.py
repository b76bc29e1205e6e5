"""Other people's packages as far as the adapters use them, with networks that know the truth of a street.

Names, signatures, shapes and conventions are those of the packages; what is seen is looked up.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import save_file
from scipy.spatial.transform import Rotation
from torch import Tensor, nn

from dreamdrive.geometry.backends.feedforward.network import fit_patches, show, standardise
from dreamdrive.geometry.resize import ResizeCrop
from dreamdrive.scene.street.truth import DriveTruth

SKY_M = 400.0


@dataclass
class Truth:
    """Finds the frames that pictures were made of, and what is true of them.

    Attributes:
        drive: The street.
        factors: Units of the networks without the metre, one a call; the last goes on.
        asked: What the network was told beside the pictures, one entry a call.
        shown: The pictures of all frames.
    """

    drive: DriveTruth
    factors: list[float] = field(default_factory=lambda: [0.1])
    asked: list[dict[str, Any]] = field(default_factory=list)
    shown: dict[ResizeCrop, Tensor] = field(default_factory=dict)

    def of(self, pictures: Tensor, *, standardised: bool = False, metric: bool = False, **asked: Any) -> Any:
        """Poses (N, 4, 4) from the first shown, pinholes, depth, points and confidence of (N, 3, H, W)."""
        self.asked.append(asked)
        factor = 1.0 if metric else self.factors.pop(0) if len(self.factors) > 1 else self.factors[0]
        height, width = pictures.shape[-2:]
        frame_width, frame_height = self.drive.frames.shape[2], self.drive.frames.shape[1]
        how = fit_patches(frame_width, frame_height, max(width, height))
        assert how.size == (width, height)
        if how not in self.shown:
            self.shown[how] = show(self.drive.frames, how)
        known = standardise(self.shown[how]) if standardised else self.shown[how]
        which = [int((known - one).abs().mean(dim=(1, 2, 3)).argmin()) for one in pictures]
        assert (known[which] - pictures).abs().max() < 1e-5
        poses = np.linalg.inv(self.drive.cameras[which[0]].world_from_camera) @ np.stack(
            [self.drive.cameras[index].world_from_camera for index in which]
        )
        poses[:, :3, 3] *= factor
        rows = ((np.arange(height) + 0.5) * frame_height / height).astype(int)
        columns = ((np.arange(width) + 0.5) * frame_width / width).astype(int)
        depth = self.drive.depth_m[which][:, rows[:, None], columns[None]]
        depth = np.where(depth > 0, depth, SKY_M) * factor
        camera = how.picture_camera(self.drive.cameras[0].at(np.eye(4)))
        return SimpleNamespace(
            poses=torch.from_numpy(poses).float(),
            intrinsics=torch.from_numpy(camera.matrix).float().expand(len(which), 3, 3).clone(),
            depth=torch.from_numpy(depth).float(),
            points=torch.from_numpy(camera.rays() * depth[..., None]).float(),
            confidence=1 + torch.rand(depth.shape),
        )


class FakeNet(nn.Module):
    """One weight, and the truth."""

    truth: Truth

    def __init__(self) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.rand(3))


def camera_from_world(poses: Tensor) -> Tensor:
    return torch.linalg.inv(poses.double()).float()[:, :3]


def fake_da3(truth: Truth) -> dict[str, dict[str, Any]]:
    """``depth_anything_3`` 0.1.1: keys ``model.``, pictures standardised, poses camera from world."""

    class DepthAnything3Net(FakeNet):
        def __init__(self, metric: bool) -> None:
            super().__init__()
            self.metric = metric

        def forward(
            self,
            x: Tensor,
            extrinsics: Tensor | None = None,
            intrinsics: Tensor | None = None,
            export_feat_layers: list[int] | None = None,
            infer_gs: bool = False,
            use_ray_pose: bool = False,
            ref_view_strategy: str = "saddle_balanced",
        ) -> dict[str, Tensor]:
            seen = truth.of(x[0], standardised=True, metric=self.metric)
            return {
                "depth": seen.depth[None],
                "depth_conf": seen.confidence[None],
                "extrinsics": camera_from_world(seen.poses)[None],
                "intrinsics": seen.intrinsics[None],
            }

    def load_config(path: str, argv: list[str] | None = None) -> dict[str, Any]:
        name = path.removeprefix("depth_anything_3.configs.")
        inner = {"gs_head": {}, "gs_adapter": {}}
        return {"anyview": inner, "name": name} if "nested" in name else {**inner, "name": name}

    def create_object(config: dict[str, Any]) -> nn.Module:
        assert "gs_head" not in config
        assert "gs_adapter" not in config.get("anyview", {})
        return DepthAnything3Net("nested" in config["name"])

    cfg = {"load_config": load_config, "create_object": create_object}
    return {"depth_anything_3": {}, "depth_anything_3.cfg": cfg}


def fake_mapanything(truth: Truth) -> dict[str, dict[str, Any]]:
    """``mapanything`` 1.1: a table a view, metric, poses world from camera, pixels counted from 0."""

    class MapAnything(FakeNet):
        def __init__(
            self,
            name: str,
            encoder_config: dict[str, Any],
            info_sharing_config: dict[str, Any],
            pred_head_config: dict[str, Any],
            geometric_input_config: dict[str, Any],
            torch_hub_force_reload: bool = False,
        ) -> None:
            super().__init__()
            self.encoder = SimpleNamespace(data_norm_type=encoder_config["data_norm_type"])
            assert not encoder_config["torch_hub_pretrained"]
            assert not torch_hub_force_reload

        def infer(
            self,
            views: list[dict[str, Any]],
            memory_efficient_inference: bool = True,
            minibatch_size: int | None = None,
            use_amp: bool = True,
        ) -> list[dict[str, Tensor]]:
            known = {"intrinsics", "camera_poses", "is_metric_scale"}
            for view in views:
                assert {"img", "data_norm_type"} <= set(view) <= {"img", "data_norm_type"} | known
                assert view["data_norm_type"] == ["dinov2"]
            pictures = torch.cat([view["img"] for view in views])
            told = {name: torch.cat([v[name] for v in views]) for name in known & set(views[0])}
            seen = truth.of(pictures, standardised=True, metric=True, **told)
            seen.intrinsics[:, :2, 2] -= 0.5
            return [
                {
                    "camera_poses": pose[None],
                    "intrinsics": matrix[None],
                    "depth_z": depth[None, ..., None],
                    "conf": confidence[None],
                }
                for pose, matrix, depth, confidence in zip(
                    seen.poses, seen.intrinsics, seen.depth, seen.confidence, strict=True
                )
            ]

    models = {"MapAnything": MapAnything}
    return {"mapanything": {}, "mapanything.models": {}, "mapanything.models.mapanything": models}


def fake_vggt(truth: Truth) -> dict[str, dict[str, Any]]:
    """``vggt``: poses camera from world as translation, quaternion xyzw, fields of view of height, width."""

    class VGGT(FakeNet):
        def __init__(
            self,
            img_size: int = 518,
            patch_size: int = 14,
            embed_dim: int = 1024,
            enable_camera: bool = True,
            enable_point: bool = True,
            enable_depth: bool = True,
            enable_track: bool = True,
        ) -> None:
            super().__init__()
            assert (enable_camera, enable_depth, enable_point, enable_track) == (True, True, False, False)

        def forward(self, images: Tensor, query_points: Tensor | None = None) -> dict[str, Tensor]:
            seen = truth.of(images[0])
            poses = camera_from_world(seen.poses).double().numpy()
            turns = torch.from_numpy(Rotation.from_matrix(poses[:, :, :3]).as_quat()).float()
            size = torch.tensor(images.shape[-2:])
            fields = 2 * torch.atan(size / 2 / seen.intrinsics[:, [1, 0], [1, 0]])
            encoded = torch.cat([torch.from_numpy(poses[:, :, 3]).float(), turns, fields], dim=1)
            return {
                "pose_enc": encoded[None],
                "depth": seen.depth[None, ..., None],
                "depth_conf": seen.confidence[None],
                "images": images,
            }

    def pose_encoding_to_extri_intri(
        pose_encoding: Tensor,
        image_size_hw: tuple[int, int] | None = None,
        pose_encoding_type: str = "absT_quaR_FoV",
        build_intrinsics: bool = True,
    ) -> tuple[Tensor, Tensor]:
        assert image_size_hw is not None
        moved, turned, fields = pose_encoding[0].split([3, 4, 2], dim=1)
        rotation = torch.from_numpy(Rotation.from_quat(turned.double().numpy()).as_matrix()).float()
        middle = torch.tensor(image_size_hw).flip(0) / 2
        intrinsics = torch.eye(3).repeat(len(moved), 1, 1)
        intrinsics[:, [0, 1], [0, 1]] = middle / torch.tan(fields.flip(1) / 2)
        intrinsics[:, :2, 2] = middle
        return torch.cat([rotation, moved[..., None]], dim=2)[None], intrinsics[None]

    encoding = {"pose_encoding_to_extri_intri": pose_encoding_to_extri_intri}
    model = {"VGGT": VGGT}
    return {
        "vggt": {},
        "vggt.models": {},
        "vggt.utils": {},
        "vggt.models.vggt": model,
        "vggt.utils.pose_enc": encoding,
    }


def fake_pi3(truth: Truth) -> dict[str, dict[str, Any]]:
    """``pi3``: poses world from camera, points in the frame of their camera, confidence as a logit."""

    def answer(seen: Any) -> dict[str, Tensor]:
        return {
            "local_points": seen.points[None],
            "conf": (seen.confidence - 1.5)[None, ..., None],
            "camera_poses": seen.poses[None],
        }

    class Pi3(FakeNet):
        def __init__(self, pos_type: str = "rope100", decoder_size: str = "large") -> None:
            super().__init__()

        def forward(self, imgs: Tensor) -> dict[str, Tensor]:
            return answer(truth.of(imgs[0]))

    class Pi3X(FakeNet):
        def __init__(self, ckpt: str | None = None, use_multimodal: bool = True) -> None:
            super().__init__()
            self.metric_token = nn.Parameter(torch.rand(2))

        def forward(
            self,
            imgs: Tensor,
            depths: Tensor | None = None,
            intrinsics: Tensor | None = None,
            rays: Tensor | None = None,
            poses: Tensor | None = None,
            with_prior: bool = True,
        ) -> dict[str, Tensor]:
            told = {"intrinsics": intrinsics, "poses": poses}
            told = {name: value[0] for name, value in told.items() if value is not None}
            return answer(truth.of(imgs[0], metric=True, **told))

    return {
        "pi3": {},
        "pi3.models": {},
        "pi3.models.pi3": {"Pi3": Pi3},
        "pi3.models.pi3x": {"Pi3X": Pi3X},
    }


FAKES: dict[str, Callable[[Truth], dict[str, dict[str, Any]]]] = {
    "da3": fake_da3,
    "mapanything": fake_mapanything,
    "vggt": fake_vggt,
    "pi3": fake_pi3,
}
KINDS = ("da3", "da3-nested", "mapanything", "vggt", "pi3", "pi3x")
"""Backends, and the models of one that differ in what they give."""
METRIC = ("da3-nested", "mapanything", "pi3x")
BACKEND = {"da3-nested": "da3", "pi3x": "pi3"}


def install(patch: pytest.MonkeyPatch, truth: Truth, kind: str) -> None:
    """Make the package of a kind importable until the patch is undone."""
    for name, content in FAKES[BACKEND.get(kind, kind)](truth).items():
        module = ModuleType(name)
        module.__spec__ = ModuleSpec(name, None, is_package=True)
        module.__path__ = []
        vars(module).update(content)
        patch.setitem(sys.modules, name, module)


CONFIGS = {
    "da3": '{"model_name": "da3-small"}',
    "da3-nested": '{"model_name": "da3nested-giant-large"}',
    "mapanything": (
        '{"name": "mapanything", "encoder_config": {"data_norm_type": "dinov2", "uses_torch_hub": true}, '
        '"info_sharing_config": {}, "pred_head_config": {}, "geometric_input_config": {}}'
    ),
    "vggt": '{"img_size": 518, "patch_size": 14, "embed_dim": 1024}',
    "pi3": '{"pos_type": "rope100", "decoder_size": "large"}',
    "pi3x": '{"ckpt": null, "use_multimodal": true}',
}


def save_weights(folder: Path, kind: str, **more: Tensor) -> Path:
    """The hub's folder of a kind's fake network."""
    folder.mkdir(parents=True, exist_ok=True)
    prefix = "model." if BACKEND.get(kind, kind) == "da3" else ""
    state = {f"{prefix}weight": torch.rand(3)}
    unused = {
        "vggt": ("track_head.a", "point_head.a"),
        "da3": ("model.gs_head.a",),
        "da3-nested": ("model.da3.gs_adapter.a",),
    }
    state |= {name: torch.rand(1) for name in unused.get(kind, ())}
    if kind == "pi3x":
        state["metric_token"] = torch.rand(2)
    save_file(state | more, folder / "model.safetensors")
    (folder / "config.json").write_text(CONFIGS[kind])
    return folder
