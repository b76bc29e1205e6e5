"""A small part of a set of golden numbers: ``python -m tests.golden.cut FROM TO``.

Numbers are copied as they are, only fewer of them. What is left out is what a few megabytes do not hold:
weights that a rule makes anew, the networks' later blocks, the second of two clips, the largest pictures.
"""

import argparse
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load_file, save_file

from tests.golden.reading import CUT

Arrays = dict[str, np.ndarray]

ENTRIES = {
    "dust3r/align_B_inputs.safetensors": r"(?!gt\.depth).*",
    "dust3r/align_B_outputs.safetensors": r"(?!modular\.|cosine\.final\.depth).*",
    "dust3r/net_inputs.safetensors": "land_.|port_b",
    "dust3r/net_linear_outputs.safetensors": r"land\..*",
    "dust3r/net_dpt_small_outputs.safetensors": r"mixed\..*|land\.(?!dpt1\.(raw|refine1)|res).*",
    "dust3r/rope.safetensors": ".*",
    "dust3r/preprocess.safetensors": r"up\..*",
    "dust3r/weiszfeld_inputs.safetensors": "noise_outliers|portrait|pp",
    "eval/frechet.npz": "(rank_deficient_20|few|constant|one_dim).*",
    "eval/perceptual.npz": "(?![02]/).*",
    "magicdrive/tiny_state_fp16.safetensors": r"controlnet\.(?!(controlnet_)?(mid|down)_block).*",
    "magicdrive/unipc_scheduler.safetensors": ".*_5|x0",
    "vista/conditioning.safetensors": r"in\..*|all\..*",
    "vista/rollout_standin.safetensors": r"enc|dec|net|images|r3\..*|decode_.*_47",
    "vista/sampler.safetensors": r"\w+scale_\d+|sigmas_.*|noise|ctx|lin_A|cond_frame|"
    r"(Van\w+\.c0|Tri\w+\.c012|Lin\w+\.none)\..*",
    "vista/tiny_unet_state_fp16.safetensors": r"(time_embed|cond_time_stack_embed|label_emb)\..*"
    r"|input_blocks\.[012]\..*",
}
"""Entries that are kept, of the files with arrays."""
TABLES = {
    "dust3r/align_config.json": r"B\.(cosine|fixed)",
    "dust3r/pairs.json": ".*",
    "dust3r/preprocess_sizes.json": ".*",
    "dust3r/state_dict_512_dpt.json": "shapes|parameters",
    "dust3r/weiszfeld.json": "noise_outliers|portrait|pp",
    "eval/frechet.json": "(rank_deficient_20|few|constant|one_dim).*",
    "eval/perceptual.json": "(?!image_[02]).*",
    "magicdrive/magicdrive_checkpoint_keys.json": ".*",
    "magicdrive/tiny_config.json": ".*",
    "vista/tiny_unet_config.json": ".*",
}
"""Entries that are kept, of the files with tables."""
LAYERS = re.compile(r".*\.resblocks\.(?!0\.)\d+\.|first_stage_model\.encoder|.*encoder\.decoder\.")
"""Layers of the published image encoder that say no more than the first, and what nothing needs."""
BLOCKS = re.compile(r".*\.(output_blocks|input_blocks\.[4-9]|input_blocks\.1\d)\.")
"""Those of the table of the UNet's names."""


def cut(source: Path, to: Path) -> int:
    """Write the part of a set; returns its size in bytes."""
    for name, pattern in ENTRIES.items():
        write(to / name, {k: v for k, v in read(source / name).items() if re.fullmatch(pattern, k)})
    for name, pattern in TABLES.items():
        write(to / name, {k: v for k, v in read(source / name).items() if re.fullmatch(pattern, k)})
    for name, part in PARTS.items():
        write(to / name, part(read(source / name)))
    state = "vista/tiny_unet_state_fp16.safetensors"
    missing = {
        k: list(v.shape) for k, v in read(source / state).items() if not re.fullmatch(ENTRIES[state], k)
    }
    write(to / "vista/tiny_unet_left_out.json", missing)
    write(to / CUT, {"what": "a part of the golden numbers, by tests/golden/cut.py"})
    return sum(
        file.stat().st_size for file in to.rglob("*") if file.suffix in (".json", ".npz", ".safetensors")
    )


def _seeded(models: dict[str, Any]) -> dict[str, Any]:
    """The small networks, with weights by the rule that made them too, and some of the checksums."""
    kept = {name: model | {"weights": "recipe"} for name, model in models.items() if name != "dpt"}
    for model in kept.values():
        model["checksums"] = dict(list(model["checksums"].items())[::64])
    return kept


def _last_clip(given: Arrays) -> Arrays:
    """One clip through the blocks whose weights are kept; clips do not see each other."""
    frames, rows = int(given["in.num_frames"][0]), len(given["in.x"])
    names = [k for k in given if k.startswith("in.") and k != "in.context_3tok"]
    kept = {k: given[k] for k in (*names, "out.feat.input_blocks.1", "out.feat.input_blocks.2")}
    last = {rows: -frames, rows // frames: -1}
    return {k: v if k == "in.num_frames" else v[last[len(v)] :] for k, v in kept.items()}


def _first_step(given: Arrays) -> Arrays:
    """One time step as far as the weights reach that are kept."""
    left_out = r"out\.(pipe.*|unet.*|cn_.*|uncond_camera_param)|in\.pipe.*"
    steps, views = given["in.camera_param"].shape[:2]
    first = {steps: 1, steps * views: views, 1: 1}
    return {k: v[: first[len(v)]] for k, v in given.items() if not re.fullmatch(left_out, k)}


def _first_clip(given: Arrays) -> Arrays:
    """Half the rows of the block that looks along time, which are one of two clips."""
    kept = {k: v for k, v in given.items() if k.startswith("s_ff_t_last.")}
    return {k: v if ".state." in k else v[: len(v) // 2] for k, v in kept.items()}


PARTS = {
    "dust3r/net_config.json": _seeded,
    "vista/unet_forward.safetensors": _last_clip,
    "magicdrive/forward.safetensors": _first_step,
    "magicdrive/temporal_block.safetensors": _first_clip,
    "magicdrive/temporal_block.json": lambda about: about | {"batch": 1},
    "vista/vista_checkpoint_keys.json": lambda keys: {k: v for k, v in keys.items() if not LAYERS.match(k)},
    "vista/map_clip_to_transformers.json": lambda keys: {
        k: v for k, v in keys.items() if not LAYERS.match(k)
    },
    "vista/map_vae_to_diffusers.json": lambda keys: keys,
    "vista/map_unet_to_diffusers.json": lambda keys: {k: v for k, v in keys.items() if not BLOCKS.match(k)},
}


def read(file: Path) -> dict[str, Any]:
    """Entries of a file of arrays or of a table."""
    if file.suffix == ".json":
        return json.loads(file.read_text())
    return dict(np.load(file)) if file.suffix == ".npz" else load_file(file)


def write(file: Path, entries: dict[str, Any]) -> None:
    """Write such a file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    if file.suffix == ".json":
        file.write_text(json.dumps(entries, separators=(",", ":")) + "\n")
    elif file.suffix == ".npz":
        np.savez_compressed(file, **entries)
    else:
        save_file({key: np.ascontiguousarray(value) for key, value in entries.items()}, file)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=Path, help="folder of a whole set")
    parser.add_argument("to", type=Path, help="folder for the part")
    given = parser.parse_args()
    print(f"{cut(given.source, given.to) / 1e6:.2f} MB")  # noqa: T201


if __name__ == "__main__":
    main()
