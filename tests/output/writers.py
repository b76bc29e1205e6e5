"""All commands that write, delete or replace, and small inputs for them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.export import write_ply
from dreamdrive.export.nuscenes.writer import write_nuscenes
from dreamdrive.prior.vista.kinds import SVD, VISTA
from dreamdrive.scene.scene import Provenance
from dreamdrive.stored import save_scene
from dreamdrive.street_network.network import StreetNetwork
from dreamdrive.street_network.weights import Training, write_network
from tests.cli.test_commands import driving
from tests.evaluate.sets import write_set
from tests.export.scenes_of_drives import upright_scene_of
from tests.logs import log
from tests.output.server import Came
from tests.prior.vista.photos import save_photo
from tests.prior.vista.tiny import save_folder, save_official
from tests.records import write_folder
from tests.scene.scenes import make_scene


@dataclass(frozen=True)
class Writer:
    """A command that writes to ``OUT``; paths below ``IN`` are its inputs.

    ``ending`` is that of a file, and empty of a folder. With ``force`` what an earlier run left is replaced.
    A run ``goes_on`` in a folder where an earlier one stopped. Files that are not the same in each run are
    ``loose``. It is stopped at so many ``moments``; each further format of a command, which goes through the
    same door, at ``FURTHER_MOMENTS``.
    """

    command: str
    ending: str = ""
    force: tuple[str, ...] = ()
    goes_on: bool = False
    loose: tuple[str, ...] = ()
    moments: int = 20

    @property
    def words(self) -> list[str]:
        """What is typed."""
        return [*self.command.split(), *self.force]


FURTHER_MOMENTS = 6
_SMALL = "--frames 0:2 --size 64x40"
_FORCE = ("--force",)
WRITERS = {
    "generate": Writer(
        "generate --prior street-world --knowledge none --quality draft --frames 0:3 --size 64x40 -o OUT",
        goes_on=True,
        loose=("report.json", "report.png"),
    ),
    "look": Writer("look IN/photo.jpg --knowledge IN/street.safetensors -o OUT", force=_FORCE),
    "render mp4": Writer("render IN/scene --trajectory stop --fps 5 -o OUT", ".mp4"),
    "render png": Writer("render IN/scene --trajectory stop --fps 5 --format png -o OUT"),
    "render npz": Writer("render IN/scene --trajectory stop --fps 5 --format npz -o OUT"),
    "actors": Writer("actors IN/scene -o OUT", ".png"),
    "edit": Writer("edit IN/scene --move 0=0,1 --copy 0=2,0 -o OUT", "", _FORCE),
    "edit insert": Writer("edit IN/scene --insert IN/scene:0@9,0 -o OUT", "", _FORCE),
    "plan": Writer("plan IN/run -o OUT", force=_FORCE),
    "export ply file": Writer("export IN/scene --to ply -o OUT", ".ply", _FORCE),
    "export ply": Writer("export IN/scene --to ply -o OUT", "", _FORCE),
    "export nuscenes": Writer("export IN/run --to nuscenes -o OUT", "", _FORCE),
    "export nuscenes with labels": Writer(
        "export IN/of-drive --to nuscenes --labels IN/set -o OUT", "", _FORCE
    ),
    "export nuscenes of a world": Writer("export IN/world --to nuscenes -o OUT", "", _FORCE),
    "export ncore": Writer("export IN/run --to ncore -o OUT", "", _FORCE),
    "export colmap": Writer("export IN/run --to colmap -o OUT", "", _FORCE),
    "export nerfstudio": Writer("export IN/run --to nerfstudio -o OUT", "", _FORCE),
    "export tum": Writer("export IN/scene --to tum -o OUT", ".txt", _FORCE),
    "export tum along a new drive": Writer(
        "export IN/scene --to tum --trajectory stop --fps 5 --without 0 -o OUT", ".txt", _FORCE
    ),
    "export depth": Writer("export IN/run --to depth -o OUT", "", _FORCE),
    "export flow": Writer("export IN/run --to flow -o OUT", "", _FORCE),
    "export nerfstudio blurred": Writer("export IN/run --to nerfstudio --blur -o OUT", "", _FORCE),
    "export mesh": Writer("export IN/run --to mesh -o OUT", ".glb", _FORCE),
    "export mcap": Writer("export IN/run --to mcap -o OUT", ".mcap", _FORCE),
    "export spz": Writer("export IN/scene --to spz -o OUT", "", _FORCE),
    "export glb file": Writer("export IN/scene --to glb -o OUT", ".glb", _FORCE),
    "export sog": Writer("export IN/scene --to sog -o OUT", ".sog", _FORCE),
    "export usd": Writer("export IN/scene --to usd -o OUT", ".usdc", _FORCE),
    "export 4dgs": Writer("export IN/scene --to 4dgs -o OUT", ".4dgs", _FORCE),
    "export html": Writer("export IN/scene --to html -o OUT", ".html", _FORCE),
    "import": Writer("import IN/splats.ply -o OUT", "", _FORCE),
    "evaluate video": Writer("evaluate video IN/real IN/real --window 0 --resamples 0 --json OUT", ".json"),
    "evaluate consistency": Writer(
        "evaluate consistency IN/world/frames --trajectory IN/world/poses.json --fps 10 --json OUT", ".json"
    ),
    "evaluate geometry": Writer("evaluate geometry IN/run --truth IN/world --json OUT", ".json"),
    "evaluate geometry picture": Writer("evaluate geometry IN/run --truth IN/world --picture OUT", ".png"),
    "evaluate decomposition": Writer("evaluate decomposition IN/run IN/world --json OUT", ".json"),
    "evaluate perception": Writer(
        "evaluate perception --mode realism --real IN/bev --synthetic IN/bev --validation IN/bev "
        "--network quick --classes road --trunk street --steps 1 --batch 1 -o OUT",
        goes_on=True,
    ),
    "data show": Writer("data show IN/set --scene 0 -o OUT", ".png"),
    "dataset make": Writer("dataset make IN/set --size 64x32 --cells 16 -o OUT", "", _FORCE),
    "world make": Writer("world make --seed 4 --frames 2 --size 64x40 --one-ray -o OUT", "", _FORCE),
    "prior sample": Writer(f"prior sample --prior street-world {_SMALL} -o OUT", "", _FORCE),
    "prior features": Writer(
        "prior features IN/real/a --weights IN/vista --size 64x64 -o OUT", ".safetensors"
    ),
    "prior convert": Writer("prior convert IN/svd.safetensors OUT --dtype float32", "", _FORCE),
    "train street": Writer("train street --data IN/records --steps 1 --batch 1 -o OUT", goes_on=True),
    "train photo": Writer(
        "train photo --streets 1 --each 1 --steps 1 --batch 1 -o OUT",
        goes_on=True,
        moments=8,  # a run takes ten seconds: it starts another process
    ),
    "train restorer": Writer(
        "train restorer --drives IN/drive/frames --each 1 --steps 1 --batch 1 --stlpips 0 -o OUT",
        goes_on=True,
        moments=4,  # it makes three scenes, in two other processes
    ),
}


_INPUTS = (
    "world make --seed 1 --frames 3 --size 64x40 --one-ray -o IN/world",
    "world make --seed 1 --frames 3 --size 240x144 --one-ray -o IN/drive",
    "world make --seed 1 --frames 2 --size 96x54 --one-ray --cameras surround -o IN/surround",
    "generate IN/world --knowledge none --quality draft -o IN/run",
    "export IN/surround --to nuscenes -o IN/street",
    "dataset make IN/street --size 208x96 --cells 104 -o IN/bev",
)


def make_inputs(folder: Path, run: Callable[[list[str]], Came]) -> None:
    """All that the commands read."""
    made = driving(make_scene())
    known = Provenance(up=(0.0, -1.0, 0.0), camera_height_m=1.5)
    save_scene(replace(made, provenance=known), folder / "scene")
    write_ply(make_scene().static, folder / "splats.ply")
    logs = [log(folder / "pictures of a log" / name, name) for name in ("scene-0001", "scene-0002")]
    write_nuscenes(logs, folder / "set", read_points)
    save_scene(upright_scene_of(logs[0]), folder / "of-drive")
    torch.manual_seed(0)
    learned = Training(0, 0, "none", {}, {}, "none")
    write_network(StreetNetwork(), learned, folder / "street.safetensors")
    save_photo(folder / "photo.jpg")
    write_set(folder / "real")
    save_official(folder / "svd.safetensors", SVD)
    save_folder(folder / "vista", VISTA)
    write_folder(folder / "records", range(1_000_000, 1_000_002), frames=1, kept_out=1)
    for command in _INPUTS:
        made = run([word.replace("IN/", f"{folder}/") for word in command.split()])
        assert made.code == 0, (command, made.said)
