"""``dreamdrive prior``: priors on their own."""

from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes, Positional, arg

from dreamdrive.cli.terminal.arguments import DeviceFlag, PriorName, commands_of, parse_action, parse_size
from dreamdrive.cli.terminal.asked import asked
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.errors import InputError
from dreamdrive.files.given import CLIP, check_there
from dreamdrive.names import DtypeName

_ASKED = ("frames", "fps", "size", "intrinsics", "hfov_deg", "trajectory", "action", "prompt", "steps")
"""What a prior alone is asked for."""


def convert(
    file: Annotated[Positional[Path], arg(metavar="FILE")],
    folder: Annotated[Positional[Path], arg(metavar="DIR")],
    *,
    dtype: DtypeName = "float16",
    force: bool = False,
) -> None:
    """Turn the single file of Vista or Stable Video Diffusion into a folder, which loads faster.

    Args:
        file: vista.safetensors or svd_xt.safetensors.
        folder: Folder to write, for --weights.
        dtype: float16 halves the folder and suits a GPU; the autoencoder stays in float32.
        force: Replace a folder that is there already.
    """
    check_there(file, "vista.safetensors or svd_xt.safetensors")
    _check_packages()
    from dreamdrive.prior.vista.convert import convert as run

    console = plain()
    with Bars(console) as bars:
        made = run(
            file, folder, dtype, replace=force, progress=lambda done, total: bars("convert", done, total)
        )
    kind = made.stored.kind
    console.print(f"{folder}: {kind.title}, for --prior {kind.name} --weights {folder}")
    for note in made.notes:
        console.print(note)
    for what, count in made.ignored.items():
        console.print(f"left out, not needed: {what}, {count} tensors")


def sample(
    input: Annotated[Positional[Path | None], arg(metavar="INPUT", help_behavior_hint="")] = None,
    *,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    asked: asked("prior sample", *_ASKED),  # pyright: ignore[reportInvalidTypeForm]
    prior: Annotated[PriorName | None, arg(help_behavior_hint="")] = None,
    weights: Annotated[str | None, arg(metavar="PATH|NAME", help_behavior_hint="")] = None,
    device: DeviceFlag = "cpu",
    seed: Annotated[int, arg(metavar="S")] = 0,
    force: bool = False,
) -> None:
    """Run a prior alone, and write frames and features that generate takes up (docs/replay.md).

    Args:
        input: A photo, a recording or a layout, as the prior takes it.
        out: Folder to write.
        asked: What is asked of the input; STOP of --frames says how many are made.
        prior: As for generate; without it the input decides.
        weights: Its network: a file, a folder, or the name of a model that the hub's cache holds.
        device: Where the network runs.
        seed: Seed of everything random.
        force: Replace a folder that is there already.
    """
    control = asked.control(input, seed)
    use_all_cores()
    from dreamdrive.compute.device import computing_on
    from dreamdrive.run import sample as run

    console = plain()
    with computing_on(device), Bars(console) as bars:
        clip = run(
            control,
            out,
            prior=prior,
            weights=weights,
            force=force,
            progress=lambda done, total: bars("prior", done, total),
        )
    width, height = clip.size
    cameras = f" of {len(clip.rig)} cameras" if len(clip.rig) > 1 else ""
    console.print(f"{out}: {len(clip)} frames{cameras}, {width}x{height}")
    for note in clip.provenance.get("notes", []):
        console.print(note)
    options = [f"--fps {1 / clip.interval_s:g}", f"--size {width}x{height}"]
    options += [
        f"--{option} {out / name}"
        for option, name in (
            ("intrinsics", "intrinsics.json"),
            ("poses", "poses.json"),
            ("trajectory", "requested.json"),
            ("features", "features.safetensors"),
        )
        if (out / name).is_file()
    ]
    go_on = f"dreamdrive generate {out} -o OUT {' '.join(options)}"
    console.print(f"to go on: {go_on}")


def features(
    clip: Annotated[Positional[Path], arg(metavar="CLIP")],
    *,
    out: Annotated[Path, arg(aliases=["-o"], metavar="FILE")],
    weights: Annotated[str, arg(metavar="PATH|NAME")],
    frames: Annotated[str | None, arg(metavar="START:STOP:STEP", help_behavior_hint="")] = None,
    size: Annotated[str | None, arg(metavar="WxH", help_behavior_hint="")] = None,
    block: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None,
    sigma: Annotated[float | None, arg(metavar="S", help_behavior_hint="(default: 0.3)")] = None,
    channels: Annotated[int | None, arg(metavar="C", help_behavior_hint="(default: 16)")] = None,
    action: Annotated[str | None, arg(metavar="TEXT", help_behavior_hint="")] = None,
    device: DeviceFlag = "cpu",
    seed: Annotated[int, arg(metavar="S")] = 0,
) -> None:
    """Take the features of a recorded clip from the network of Vista or Stable Video Diffusion.

    Args:
        clip: A video or a folder of images, at about the rate of the model (Vista 10 Hz, SVD 7 Hz).
        out: File to write, for generate --features.
        weights: Of Vista or SVD: a file, a folder, or the name of a model that the hub's cache holds.
        frames: Frames of the clip to use; give generate the same.
        size: Size at which the network sees the frames, in multiples of 64; without it the nearest.
        block: Name of a block of the UNet.
        sigma: Noise on the latents, whose own deviation is about 1.
        channels: Principal components to keep.
        action: What the car does, for Vista, as for generate.
        device: Where the network runs.
        seed: Seed of the noise.
    """
    wanted = None if size is None else parse_size(size)
    told = None if action is None else parse_action(action)
    check_there(clip, CLIP)
    use_all_cores()
    _check_packages()
    from dreamdrive.compute.device import computing_on
    from dreamdrive.run import clip_features

    options = {"block": block, "sigma": sigma, "channels": channels}
    console = plain()
    with computing_on(device), Bars(console) as bars:
        made = clip_features(
            clip,
            out,
            weights,
            {name: value for name, value in options.items() if value is not None},
            frames=frames,
            size=wanted,
            action=told,
            seed=seed,
            progress=lambda done, total: bars("features", done, total),
        )
    for name, array in made.arrays.items():
        count, rows, columns, kept = array.shape
        words = f"{name}, {count} frames of {columns}x{rows}, {kept} channels"
        console.print(f"{out}: {words}")


def _check_packages() -> None:
    """What networks of video models need is installed."""
    from dreamdrive.prior import choose_prior

    if (missing := choose_prior("vista").missing_package()) is not None:
        raise InputError(missing)


_Prior = commands_of({"sample": sample, "features": features, "convert": convert})


def prior(what: Annotated[_Prior, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Generative priors alone: frames, features, networks.

    Args:
        what: What to do.
    """
