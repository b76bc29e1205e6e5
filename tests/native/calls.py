"""A call of each function of the compiled core with arguments that are right."""

from collections.abc import Callable
from typing import Any

import numpy as np

from dreamdrive import _native

Arguments = dict[str, Any]
_N, _H, _W = 50, 24, 32


def _f(*shape: int) -> np.ndarray:
    return np.random.default_rng(0).normal(size=shape).astype(np.float32)


def _z(*shape: int) -> np.ndarray:
    return np.zeros(shape, np.float32)


def _gaussians() -> Arguments:
    return {
        "means": _f(_N, 3) + np.float32(5),
        "quaternions": _f(_N, 4),
        "scales": np.abs(_f(_N, 3)),
        "opacities": np.full(_N, 0.5, np.float32),
        "sh": _f(_N, 4, 3),
        "channels": _f(_N, 2),
        "offsets": _f(_N, 2),
        "sh_degree": 1,
    }


def _forward() -> Arguments:
    return {
        "gaussians": _native.gaussians(**_gaussians()),
        "camera_from_world": np.eye(4, dtype=np.float32),
        **{"fx": 30.0, "fy": 30.0, "cx": 16.0, "cy": 12.0, "width": _W, "height": _H, "antialiased": True},
        **{"colour": _z(_H, _W, 3), "alpha": _z(_H, _W), "depth": _z(_H, _W), "channels": _z(_H, _W, 2)},
        "visible": np.zeros(_N, bool),
        "keep": True,
    }


def _frame() -> Arguments:
    made = _forward()
    return {"gaussians": made["gaussians"], "frame": _native.forward(**made)}


def _backward() -> Arguments:
    images = {"colour": _f(_H, _W, 3), "alpha": _f(_H, _W), "depth": _f(_H, _W), "channels": _f(_H, _W, 2)}
    gradients = {f"d_{name}": np.zeros_like(_gaussians()[name]) for name in _GRADIENTS}
    screen = {"d_screen": _z(_N, 2), "d_screen_absolute": _z(_N, 2)}
    return {**_frame(), **images, **gradients, **screen, "d_pose": _z(4, 4)}


_GRADIENTS = ("means", "quaternions", "scales", "opacities", "sh", "channels")


def _images(*names: str) -> Arguments:
    return {name: _f(_H, _W, 3) for name in names}


def _sky() -> Arguments:
    return {"colour": _f(_H, _W, 3), "alpha": _f(_H, _W), "sky": _f(_H, _W, 3), "affine": _f(3, 4)}


def _geometry_loss() -> Arguments:
    images = {name: _f(_H, _W) for name in ("depth_sum", "alpha", "reference", "weight")}
    numbers = {"by_disparity": 1.0, "by_coverage": 1.0, "whole_weight": 3.0}
    return {
        **images,
        "sky": np.ones((_H, _W), bool),
        **numbers,
        "d_depth_sum": _z(_H, _W),
        "d_alpha": _z(_H, _W),
    }


def _activate() -> Arguments:
    given = {
        "means": _f(5, 3),
        "unit": _f(5),
        "offsets": _f(5, 3),
        "quaternions": _f(5, 4),
        "log_scales": _f(5, 3),
    }
    made = {"out_means": _z(9, 3), "out_quaternions": _z(9, 4), "scales": _z(9, 3), "opacities": _z(9)}
    return {**given, "logits": _f(5), "sh": _f(5, 4, 3), "to": 2, **made, "out_sh": _z(9, 4, 3)}


def _activate_backward() -> Arguments:
    given = {"unit": _f(5), "to": 2, "scales": _f(9, 3), "opacities": _f(9), "d_means": _f(9, 3)}
    made = {"d_offsets": _z(5, 3), "d_log_scales": _z(5, 3), "d_logits": _z(5)}
    return {**given, "d_scales": _f(9, 3), "d_opacities": _f(9), **made}


def _adam() -> Arguments:
    state = {name: [_f(7, 3), _f(7)] for name in ("values", "gradients", "means", "squares")}
    return {
        **state,
        "rates": [[0.1] * 3, [0.1]],
        "steps": [1, 2],
        "beta1": 0.9,
        "beta2": 0.99,
        "epsilon": 1e-8,
    }


def _encoded_tensors() -> list[np.ndarray]:
    return [_f(8, 30), _f(8), _f(2, 8), _f(2)]


def _encoded_network() -> Arguments:
    points = {"means": _f(_N, 3), "centre": _f(3), "radius": 1.0, "position_octaves": 4, "time_code": _f(3)}
    return {"tensors": _encoded_tensors(), "depth": 1, "skip": -1, **points}


def _dense_tensors() -> list[np.ndarray]:
    return [_f(8, 4), _f(8), _f(2, 8), _f(2)]


def _dense() -> Arguments:
    return {"network": _native.dense_network(_dense_tensors(), 1), "inputs": _f(_N, 4)}


def _planes() -> Arguments:
    space, lines = [_f(3, 8, 4, 4), _f(3, 8, 8, 8)], [_f(3, 8, 4), _f(3, 8, 8)]
    return {
        "space": space,
        "lines": lines,
        "means": _f(_N, 3),
        "low": -np.ones(3, np.float32),
        "high": _z(3) + 1,
    }


def _pose() -> Arguments:
    given = {"means": _f(5, 3), "quaternions": _f(5, 4), "log_scales": _f(5, 3), "logits": _f(5)}
    tracks = {
        "translation": _f(2, 3),
        "yaw": _f(2),
        "pivot": _f(2, 3),
        "up": np.array([0, -1, 0], np.float32),
    }
    actor = np.array([0, 1, -1, 0, 1])
    return {**given, "residual": _f(5, 10), "lifespan": _f(5, 2), "actor": actor, **tracks, "time_s": 0.5}


def _posed() -> Arguments:
    return {"means": _f(5, 3), "quaternions": _f(5, 4), "log_scales": _f(5, 3), "logits": _f(5)}


def _pose_backward() -> Arguments:
    made = {"d_means": _z(5, 3), "d_quaternions": _z(5, 4), "d_logits": _z(5), "d_residual": _z(5, 10)}
    return {"pose": _native.pose(**_pose()), **_posed(), **made, "d_translation": _z(2, 3), "d_yaw": _z(2)}


def _sources() -> Arguments:
    return {
        "grey": _f(12, 20),
        "greys": [_f(12, 20)] * 2,
        "usable": [np.ones((12, 20), bool), _f(12, 20) > 0],
        "homographies": np.tile(np.eye(3), (2, 3, 1, 1)),
        "least_z": 0.1,
    }


def _sweep_cost() -> Arguments:
    given = {"mean": _f(12, 20), "variance": np.abs(_f(12, 20)), "side": 5, "centre": 0.5, "noise": 1e-3}
    return {**_sources(), **given, "cost": _z(12, 3, 20)}


def _smooth() -> Arguments:
    given = {"cost": _f(6, 5, 9), "jump_down": _f(5, 9), "jump_right": _f(6, 8), "step": 1.0}
    return {**given, "total": _z(6, 5, 9), "label": _z(6, 9)}


def _minimum_cut() -> Arguments:
    rng = np.random.default_rng(0)
    right, below = (rng.integers(0, 9, shape, dtype=np.int32) for shape in ((8, 7), (7, 8)))
    gain = rng.integers(-9, 9, (8, 8), dtype=np.int32)
    return {"gain": gain, "right": right, "below": below, "labelled": np.zeros((8, 8), bool)}


def _mix() -> Arguments:
    reach = 2
    return {
        "answer": _f(3, _H, _W),
        "pictures": np.abs(_f(2, 4, _H + 2 * reach, _W + 2 * reach)) + np.float32(0.1),
        "taps": np.array([[0, 0, 0], [1, -reach, reach]], np.int32),
        "details": np.array([[0, -reach]], np.int32),
        "own": 4.0,
        "most_detail": 0.5,
        "gentle": 4.0,
        "mixed": _z(3, _H, _W),
    }


CALLS: dict[str, Callable[[], Arguments]] = {
    "gaussians": _gaussians,
    "forward": _forward,
    "backward": _backward,
    "inspect": lambda: {**_frame(), "median_depth": _z(_H, _W), "weight_sum": _z(_N), "weight_most": _z(_N)},
    "ssim_forward": lambda: {**_images("image", "target", "map"), "partials": _z(3, _H, _W, 3)},
    "ssim_backward": lambda: {**_images("image", "target", "d_map", "d_image"), "partials": _f(3, _H, _W, 3)},
    "l1_ssim": lambda: {
        **_images("image", "target"),
        "mask": np.ones((_H, _W), bool),
        "partials": _z(3, _H, _W, 3),
    },
    "l1_ssim_backward": lambda: {
        **_images("image", "target", "d_image"),
        **{"mask": np.ones((_H, _W), bool), "partials": _f(3, _H, _W, 3), "by_l1": 1.0, "by_ssim": 1.0},
    },
    "over_sky": lambda: {**_sky(), "picture": _z(_H, _W, 3)},
    "over_sky_backward": lambda: {
        **_sky(),
        **{
            "d_picture": _f(_H, _W, 3),
            "d_colour": _z(_H, _W, 3),
            "d_alpha": _z(_H, _W),
            "d_affine": _z(3, 4),
        },
    },
    "geometry_loss": _geometry_loss,
    "activate": _activate,
    "activate_backward": _activate_backward,
    "adam": _adam,
    "encoded_network": _encoded_network,
    "encoded_network_forward": lambda: {
        "network": _native.encoded_network(**_encoded_network()),
        "out": _z(_N, 2),
    },
    "encoded_network_backward": lambda: {
        "network": _native.encoded_network(**_encoded_network()),
        **{"d_out": _f(_N, 2), "gradients": _encoded_tensors()},
    },
    "dense_network": lambda: {"tensors": _dense_tensors(), "depth": 1},
    "dense_network_forward": lambda: {**_dense(), "out": _z(_N, 2)},
    "dense_network_backward": lambda: {
        **_dense(),
        "d_out": _f(_N, 2),
        "d_inputs": _z(_N, 4),
        "gradients": _dense_tensors(),
    },
    "planes": _planes,
    "planes_forward": lambda: {"planes": _native.planes(**_planes()), "features": _z(_N, 16)},
    "planes_backward": lambda: {
        "planes": _native.planes(**_planes()),
        **{"d_features": _f(_N, 16), "d_space": _planes()["space"], "d_lines": _planes()["lines"]},
    },
    "steepness": lambda: {"images": _f(5, 8, 8), "weight": 1.0, "d_images": _z(5, 8, 8)},
    "pose": _pose,
    "pose_forward": lambda: {"pose": _native.pose(**_pose()), **_posed()},
    "pose_backward": _pose_backward,
    "keep_freed_memory": dict,
    "stage_seconds": dict,
    "all_usable": lambda: {"gaussians": _native.gaussians(**_gaussians())},
    "set_threads": lambda: {"count": 2},
    "threads": dict,
    "isa": dict,
    "sweep_cost": _sweep_cost,
    "sweep_misfit": lambda: {**_sources(), "most": 1.0, "misfit": _z(3, 12, 20)},
    "smooth": _smooth,
    "weighted_median": lambda: {"values": _f(5, 40), "weights": np.abs(_f(5, 40)), "median": _z(40)},
    "minimum_cut": _minimum_cut,
    "mix": _mix,
}
"""A right call of each function, by its name."""
