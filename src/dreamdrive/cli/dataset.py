"""``dreamdrive dataset make``: samples for perception, of scenes along new paths and of recorded drives."""

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes, Positional, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.arguments import DataSetName, DeviceFlag, commands_of, parse_size
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.errors import InputError
from dreamdrive.files.given import DATASET, SCENE, check_there
from dreamdrive.files.kinds import SAMPLES_KIND
from dreamdrive.files.output import check_free

if TYPE_CHECKING:
    from dreamdrive.data import Logs
    from dreamdrive.scene.scene import Scene
    from dreamdrive.scene.street.log import Log
    from dreamdrive.tasks.perception import BevGrid, BevSample, ImageSize, PathOptions, SampleNote

_PUBLISHED = (480, 270)
"""Size to which the original resizes pictures, before 46 rows of the sky are cut off."""


@dataclass(frozen=True)
class SampleFlags:
    """What samples hold, and where those of scenes are taken.

    Attributes:
        per_scene: Samples of each; without it 40 of a scene that is rendered, and all labelled times.
        size: Width and height of the pictures, with the upper 17 % of 16:9 cut away as the original does.
        cells: Cells of the labels each way, of 100 m.
        aside: Most that new paths are to the left or right of the recorded one in metres.
        turned: Most that they look to the left or right of the recorded direction in degrees.
        least_trust: PSNR to expect of a sample's pictures in decibels, below which it is left out; without it
            any will do.
        device: Where pictures of scenes are drawn; cuda takes an NVIDIA GPU and gsplat (docs/gpu.md).
        format: Of the pictures.
        seed: Of the paths.
    """

    per_scene: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None
    size: Annotated[str, arg(metavar="WxH")] = "480x224"
    cells: Annotated[int, arg(metavar="N")] = 200
    aside: Annotated[float, arg(metavar="M")] = 1.5
    turned: Annotated[float, arg(metavar="DEG")] = 6.0
    least_trust: Annotated[float | None, arg(metavar="DB", help_behavior_hint="")] = None
    device: DeviceFlag = "cpu"
    format: Literal["jpg", "png"] = "jpg"
    seed: Annotated[int, arg(metavar="S")] = 0


def make(
    sources: Annotated[Positional[tuple[Path, ...]], arg(metavar="OUT|DATASET...")],
    *,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    labels: Annotated[Path | None, arg(metavar="DATASET", help_behavior_hint="")] = None,
    dataset: Annotated[DataSetName | None, arg(help_behavior_hint="")] = None,
    scene: Annotated[str | None, arg(metavar="NAME|N", help_behavior_hint="")] = None,
    sample: OmitArgPrefixes[SampleFlags] = SampleFlags(),
    force: bool = False,
) -> None:
    """Make samples for networks that see a street from above: pictures of all cameras, and labels.

    Args:
        sources: Folders that generate wrote of drives of a data set, which are rendered along new paths; or
            folders of a data set, whose labelled times are taken as they were recorded.
        out: Folder to write.
        labels: The data set with the boxes and the map of the drives that scenes were made of.
        dataset: Which data set it is; without it the one that recognises the path.
        scene: Which scene of a data set among the sources; without it all.
        sample: What samples hold, and where those of scenes are taken.
        force: Replace a set that is there already.
    """
    width, height, cut = _cut_size(sample.size, sample.cells)
    for path in (*sources, labels):
        check_there(path, f"{SCENE}, or {DATASET}")
    check_free(out, force, SAMPLES_KIND)
    use_all_cores()
    from dreamdrive.compute.device import computing_on
    from dreamdrive.splat import why_unusable
    from dreamdrive.tasks.perception import BevGrid, ImageSize, PathOptions, write_bev_set

    image, grid = ImageSize(height, width, cut), BevGrid(sample.cells, sample.cells)
    console = plain()
    paths = PathOptions(sample.aside, sample.turned, least_psnr_db=sample.least_trust)
    made = _Maker(image, grid, paths, sample.per_scene, sample.seed)
    plans = [plan for source in sources for plan in made.plans(source, labels, dataset, scene)]
    start = time.perf_counter()
    with computing_on(sample.device, why_unusable), Bars(console) as bars:
        write_bev_set(
            made.samples(plans),
            out,
            image,
            grid,
            count=sum(count for _, _, count in plans),
            suffix=sample.format,
            left_out=made.left_out,
            replace=force,
            progress=partial(bars, "samples"),
        )
    seconds, done = time.perf_counter() - start, made.done
    console.print(f"{out}: {done} samples in {seconds:.1f} s, {done / seconds:.1f} samples/s")
    for why, number in made.left_out.items():
        if number:
            console.print(f"{number} left out: {why}")


_Plan = tuple["Scene | None", "Log", int]


class _Maker:
    """Samples of scenes and drives, and how many are left out and why."""

    def __init__(
        self, image: "ImageSize", grid: "BevGrid", path: "PathOptions", per_scene: int | None, seed: int
    ) -> None:
        self.image, self.grid, self.path, self.per_scene, self.seed = image, grid, path, per_scene, seed
        self.left_out: Counter[str] = Counter()
        self.done = 0

    def plans(self, source: Path, labels: Path | None, dataset: str | None, scene: str | None) -> list[_Plan]:
        """What is made of a source: with a scene if it is one, the drive, and about how many."""
        from dreamdrive.data import choose_scene
        from dreamdrive.data.input import dataset_of

        if (source / "scene" / "scene.json").is_file() or (source / "scene.json").is_file():
            made = open_scene(source)
            link = made.provenance.log
            if link is None or labels is None:
                raise InputError(
                    f"{source} is a scene; expected one that was made of a drive of a data set, and --labels "
                    "with that data set: boxes and map of samples are those of the drive"
                )
            log = _logs(labels, dataset).read(labels, link.name)
            return [(made, log, self.per_scene or 40)]
        logs = dataset_of(dataset, source).logs
        if logs is None:
            raise InputError(f"{source} is neither a scene nor a data set with labels")
        names = logs.names(source) if scene is None else (choose_scene(logs.names(source), scene, source),)
        drives = [logs.read(source, name) for name in names]
        return [(None, log, min(len(log.times_s), self.per_scene or len(log.times_s))) for log in drives]

    def samples(self, plans: list[_Plan]) -> Iterator[tuple["SampleNote", "BevSample"]]:
        """All of them, one after the other."""
        from dreamdrive.compute.device import chosen_device
        from dreamdrive.tasks.perception import draw_places, samples_of_log, samples_of_scene, span_of

        named: Counter[str] = Counter()
        for number, (scene, log, count) in enumerate(plans):
            if scene is None:
                made = samples_of_log(log, self.image, self.grid, self.per_scene)
            else:
                span = span_of(scene, log)
                places, near = draw_places(log, span, count, self.path, self.seed + number)
                self.left_out["as good as another one"] += near
                first = named[log.name]  # several scenes may be of one drive
                named[log.name] += len(places)
                there = scene.on(chosen_device())
                made = samples_of_scene(there, log, places, self.image, self.grid, self.path, first)
            for sample in made:
                if isinstance(sample, str):
                    self.left_out[sample] += 1
                else:
                    self.done += 1
                    yield sample


def _cut_size(size: str, cells: int) -> tuple[int, int, int]:
    """Width and height of the pictures, and the rows above that are cut away."""
    width, height = parse_size(size)
    whole = round(width * _PUBLISHED[1] / _PUBLISHED[0])
    if height > whole:
        raise InputError(
            f"--size {size}: higher than 16:9, of which the upper part is cut away; at most {whole}"
        )
    if cells < 8:
        raise InputError(f"--cells {cells}: expected 8 or more")
    return width, height, whole - height


def _logs(path: Path, dataset: str | None) -> "Logs":
    from dreamdrive.data.input import dataset_of

    logs = dataset_of(dataset, path).logs
    if logs is None:
        raise InputError(f"--labels {path} is no data set with labels")
    return logs


_Dataset = commands_of({"make": make})


def dataset(what: Annotated[_Dataset, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Training data for perception.

    Args:
        what: What to do.
    """
