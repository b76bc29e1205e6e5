"""The part of DUSt3R of a second set."""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dreamdrive.geometry.backends.dust3r.align.focal import weiszfeld_px
from dreamdrive.geometry.backends.dust3r.align.graph import graph_of
from dreamdrive.geometry.backends.dust3r.align.spanning_tree import spanning_tree
from dreamdrive.geometry.backends.dust3r.network.blocks import Rotation, grid_positions, rotate, rotation
from dreamdrive.geometry.backends.dust3r.network.config import NetworkConfig
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from dreamdrive.geometry.backends.dust3r.network.images import any_resize_crop
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps, make_pairs
from dreamdrive.geometry.resize import prepare
from dreamdrive_bench.geometry.authors_alignment import Objective, Raw, descend, raw_parameters
from dreamdrive_bench.geometry.simulated_pairs import Noise, Truth, pair_maps
from tests.benchmarks.geometry.test_authors_alignment import PARTS
from tests.geometry.backends.dust3r.align.pairs import street, window
from tests.geometry.backends.dust3r.align.test_focal import _plane
from tests.geometry.backends.dust3r.align.test_spanning_tree import _matrices
from tests.geometry.backends.dust3r.network.networks import config_of, golden_network, seeded_state
from tests.geometry.backends.dust3r.network.test_network import CASES, as_trained, decoded
from tests.golden.cut import write

Arrays = dict[str, np.ndarray]
_MODES = {"depth_mode": ["exp", "-inf", "inf"], "conf_mode": ["exp", "1", "inf"]}


def make(to: Path, rng: np.random.Generator) -> None:
    """Write all files."""
    with torch.no_grad():
        _networks(to, rng)
        _rope(to, rng)
    _pictures(to, rng)
    _focals(to, rng)
    noise = Noise(outliers=0.02, scale=0.2)
    count, size = int(rng.integers(4, 7)), (int(rng.integers(24, 44)), int(rng.integers(16, 30)))
    whole = pair_maps(street(count, *size), window(count), noise)
    settings = {
        **_alignment(to, "A", whole, street(count, *size), rng, ("cosine", "linear", "modular")),
        **_alignment(to, "B", _cropped(whole), street(count, *size), rng, ("cosine", "fixed")),
    }
    write(to / "dust3r/align_config.json", settings)


def _networks(to: Path, rng: np.random.Generator) -> None:
    models: dict[str, Any] = {}
    for model, head in (("linear", "linear"), ("dpt_small", "dpt")):
        heads = {side: int(rng.choice([2, 3])) for side in ("enc", "dec")}
        config = {"pos_embed": "RoPE100", "img_size": [96, 96], "output_mode": "pts3d", "head_type": head}
        config |= _MODES | {"patch_size": 16, "mlp_ratio": int(rng.choice([2, 3]))}
        for side, count in heads.items():
            config |= {f"{side}_num_heads": count, f"{side}_embed_dim": 12 * count}
        config |= {"enc_depth": int(rng.integers(1, 4)), "dec_depth": int(rng.choice([4, 6, 8]))}
        sizes = {"layer_dims": [4, 8, 12, 8], "feature_dim": 12, "last_dim": 6}
        models[model] = {"config": config, "weights": "recipe"} | ({"dpt": sizes} if head == "dpt" else {})
        state = seeded_state(config_of(models[model]))
        models[model]["checksums"] = {key: _sums(value) for key, value in state.items()}
        if head == "linear":
            models[model]["weights"] = "file"
            write(to / f"dust3r/net_{model}_weights.safetensors", {k: v.numpy() for k, v in state.items()})
    write(to / "dust3r/net_config.json", models)
    width, height = 16 * int(rng.integers(4, 7)), 16 * int(rng.integers(2, 4))
    shapes = {"land": (height, width), "port": (width, height), "big": (height + 16, width + 32)}
    images = {f"{n}_{k}": 2 * torch.rand(1, 3, *s) - 1 for n, s in shapes.items() for k in "ab"}
    write(to / "dust3r/net_inputs.safetensors", {k: v.numpy() for k, v in images.items()})
    for model in models:
        found = {k: v.numpy() for k, v in _outputs(golden_network(model), images).items()}
        write(to / f"dust3r/net_{model}_outputs.safetensors", found)
    for head in ("dpt", "linear"):
        with torch.device("meta"):
            network = Dust3r(NetworkConfig(head=head))  # type: ignore[arg-type]
        table = {"shapes": {k: list(v.shape) for k, v in network.state_dict().items()}}
        table["parameters"] = sum(part.numel() for part in network.parameters())  # type: ignore[assignment]
        write(to / f"dust3r/state_dict_512_{head}.json", table)


def _sums(value: Tensor) -> dict[str, Any]:
    exact = value.double()
    first = exact.flatten()[:3].tolist()
    return {"shape": list(value.shape), "abssum": float(exact.abs().sum()), "first": first}


def _outputs(network: Dust3r, images: dict[str, Tensor]) -> dict[str, Tensor]:
    found: dict[str, dict[str, Tensor]] = {}
    for case, (first, second) in CASES.items():
        found[case] = decoded(network, images[first], images[second])
    a, b = images["land_a"], images["land_b"]
    found["batchsym"] = decoded(network, torch.cat([a, b]), torch.cat([b, a]))
    land, port = ([(images[f"{n}_{k}"], False) for k in "ab"] for n in ("land", "port"))
    port = [(image.transpose(2, 3), True) for image, _ in port]
    found["manyar_port"] = as_trained(network, *port)
    found["manyar_cross"] = as_trained(network, land[0], port[1])
    straight = as_trained(network, *land)
    found["manyar"] = {k: torch.cat([straight[k], found["manyar_port"][k]]) for k in straight}
    first, second = network.encode(a), network.encode(b)
    places = grid_positions(first.rows, first.columns)[None]
    taps = network.decoded(first, second)
    last = len(taps[0]) - 1
    found["land"] |= {"enc1": first.values, "enc2": second.values, "pos1": places, "pos2": places}
    found["land"]["ntaps"] = torch.tensor(len(taps[0]))
    for side, tap in ((side, tap) for side in (1, 2) for tap in (1, last)):
        found["land"][f"dec{side}.{tap}"] = taps[side - 1][tap]
    return {f"{c}.{k}": v.clone().contiguous() for c, values in found.items() for k, v in values.items()}


def _rope(to: Path, rng: np.random.Generator) -> None:
    batch, heads, count, width = (int(rng.choice(s)) for s in ([1, 3], [2, 5], [7, 30], [8, 24]))
    tokens, positions = torch.randn(batch, heads, count, width), torch.randint(40, (batch, count, 2))
    cos, sin = rotation(positions, width, 100.0)
    rotated = rotate(tokens, Rotation(cos[:, None], sin[:, None]))
    found = {"tokens": tokens, "positions": positions, "rotated": rotated}
    write(to / "dust3r/rope.safetensors", {k: v.numpy() for k, v in found.items()})


def _pictures(to: Path, rng: np.random.Generator) -> None:
    pictures: Arrays = {}
    for name, size in (("wide", 120), ("square", 90), ("other", 224), ("tall", 96)):
        height, width = rng.integers(60, 140, 2).tolist()
        height, width = (height, height) if name == "square" else (height, width)
        frame = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
        made = prepare(frame, any_resize_crop(width, height, size))
        pictures |= {f"{name}.input": frame, f"{name}.output_u8": made.transpose(2, 0, 1)}
    write(to / "dust3r/preprocess.safetensors", pictures)
    sizes = {}
    for width, height in rng.integers(200, 900, (6, 2)).tolist():
        for square_ok in (False, True):
            how = any_resize_crop(width, height, 376, square_ok=square_ok)
            sizes[f"{width}x{height}|376|{'square_ok' if square_ok else 'default'}"] = list(how.size)
    write(to / "dust3r/preprocess_sizes.json", sizes)
    pairs = {}
    for frames, graph in ((4, "complete"), (7, "swin-2"), (9, "logwin-2-noncyclic"), (5, "swin-1-noncyclic")):
        found = make_pairs(frames, graph).tolist()
        pairs[f"{frames}|{graph}|sym"] = sorted(found) if "win" in graph else found
    write(to / "dust3r/pairs.json", pairs)


def _focals(to: Path, rng: np.random.Generator) -> None:
    clouds, table = {}, {}
    for case in ("noise", "other"):
        height, width = rng.integers(14, 50, 2).tolist()
        points = _plane(width, height, 0.9 * width) * rng.normal(1, 0.03, (height, width, 3))
        points, pp = points.astype(np.float32), (width / 2 - 1, height / 2 + 0.5)
        table[case] = {"pp": pp, "weiszfeld": weiszfeld_px(points, pp)}
        clouds[case] = points
    write(to / "dust3r/weiszfeld_inputs.safetensors", clouds)
    write(to / "dust3r/weiszfeld.json", table)


def _cropped(maps: PairMaps) -> PairMaps:
    """Every second image without some rows above and below, so that sizes and areas differ."""
    points, confidence = (
        tuple(
            tuple(side[2:-2] if image % 2 else side for image, side in zip(edge, pair, strict=True))
            for edge, pair in zip(maps.edges.tolist(), part, strict=True)
        )
        for part in (maps.points, maps.confidence)
    )
    return PairMaps(maps.edges, points, confidence)


def _save_maps(to: Path, name: str, maps: PairMaps, truth: Truth) -> None:
    found: Arrays = {"edges": maps.edges, "gt.cam2world": truth.world_from_camera}
    for e, (points, confidence) in enumerate(zip(maps.points, maps.confidence, strict=True)):
        found |= {f"p1.{e}": points[0], f"p2.{e}": points[1]}
        found |= {f"c1.{e}": confidence[0], f"c2.{e}": confidence[1]}
    write(to / f"dust3r/align_{name}_inputs.safetensors", found)


def _parts(raw: Raw) -> Arrays:
    return {part: getattr(raw, part).detach().numpy().copy() for part in PARTS}


def _alignment(
    to: Path, name: str, maps: PairMaps, truth: Truth, rng: np.random.Generator, runs: tuple[str, ...]
) -> dict[str, Any]:
    """Write a scene and its runs; returns their settings."""
    _save_maps(to, name, maps, truth)
    outputs: Arrays = {}
    settings: dict[str, Any] = {}
    for run in runs:
        mode, schedule = "Modular" if run == "modular" else "", "linear" if run == "linear" else "cosine"
        own = {"mode": f"{mode}PointCloudOptimizer", "schedule": schedule, "tree": []}
        own |= {"niter": int(rng.integers(100, 160)), "lr": 0.012, "lr_min": 1e-5}
        settings[f"{name}.{run}"] = own
        start = spanning_tree(maps, upstream=True, stale_focals=run != "fixed")
        found: Arrays = {"init.focals": start.focals_px, "init.poses": start.world_from_camera}
        found |= {f"init.depth.{i}": depth for i, depth in enumerate(start.depth)}
        found["init.pw_poses"] = _matrices(start)
        objective = Objective(maps, graph_of(maps), "modular" if mode else "pooled")
        raw = raw_parameters(start)
        if run == "cosine":
            outputs |= _first_steps(objective, raw, own)
        rates = {"schedule": schedule, "rate": own["lr"], "last_rate": own["lr_min"]}
        found["loss"] = descend(objective, raw, own["niter"], **rates)  # type: ignore[arg-type]
        end = objective.start_of(raw)
        found |= {"final.focals": end.focals_px, "final.poses": end.world_from_camera}
        found |= {f"final.depth.{i}": depth for i, depth in enumerate(end.depth)}
        outputs |= {f"{run}.{key}": value for key, value in found.items()}
    write(to / f"dust3r/align_{name}_outputs.safetensors", outputs)
    return settings


def _first_steps(objective: Objective, raw: Raw, settings: dict[str, Any]) -> Arrays:
    found = {f"raw.{part}": value for part, value in _parts(raw).items()}
    loss = objective(raw)
    loss.backward()
    found["grad.loss"] = loss.detach().numpy().reshape(1)
    found |= {f"grad.{part}": getattr(raw, part).grad.numpy().copy() for part in PARTS}
    for steps in (1, 3):
        moved = Raw(*(part.detach().clone().requires_grad_(True) for part in raw.tensors))
        rates = {"rate": settings["lr"], "last_rate": settings["lr_min"]}
        descend(objective, moved, steps, of=settings["niter"], **rates)
        found |= {f"step{steps}.{part}": value for part, value in _parts(moved).items()}
    return found
