"""What can be chosen by name; the names are known without loading what they stand for."""

import difflib
import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal, TypeVar, cast

from dreamdrive.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from dreamdrive.data import DataSet
    from dreamdrive.geometry import GeometryBackend
    from dreamdrive.prior import Prior

QualityName = Literal["draft", "standard", "high"]
MethodName = Literal["dreamdrive", "paper"]
TrafficName = Literal["still", "flow"]
RepresentationName = Literal["static", "deformable", "hexplane", "vibration", "hybrid"]
DeviceName = Literal["cpu", "cuda"]
Stage = Literal["prior", "look", "geometry", "initialise", "static", "score", "group", "fit"]
Show = Literal["colour", "depth", "dynamic", "static"]
Format = Literal["mp4", "png", "npz"]
PlanMethod = Literal["avoid", "uniad"]
ExportKind = Literal["ply", "nuscenes", "ncore", "mcap"]
DtypeName = Literal["float16", "float32"]
Resize = Literal["tf1", "torch", "antialias", "clean"]
"""tf1: bilinear of TensorFlow 1 without half-pixel centres (torch-fidelity); torch: bilinear (pytorch-fid);
antialias: the same with antialiasing (torchmetrics); clean: antialiased bicubic (clean-fid)."""
Covariance = Literal["sample", "population"]
FILL_NETWORK, FILL_INPAINT = "network", "inpaint"
"""What fills what a photo does not show, in place of a file: the weights that ship, no network at all."""
Stlpips = Literal["alex", "vgg", "both"]
"""Trunk of the shift-tolerant LPIPS; that of VGG takes four times as long."""

T = TypeVar("T")
_log = logging.getLogger("dreamdrive")


@dataclass(frozen=True, eq=False)
class Table(Mapping[str, T]):
    """Entries of dreamdrive's own and of outside packages by their names; each is loaded when it is taken.

    Attributes:
        option: The option that takes the names, for messages.
        group: Entry points of this group are entries, too.
        kind: What every entry is, as ``module:name``; it has an attribute ``name``.
        own: The own entries as ``module:name``, by their names.
    """

    option: str
    group: str
    kind: str
    own: Mapping[str, str]

    def __iter__(self) -> Iterator[str]:
        yield from dict.fromkeys([*self.own, *sorted(each.name for each in self._outside())])

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in list(self)

    def __getitem__(self, name: str) -> T:
        """The entry of that name.

        Raises:
            KeyError: There is none.
            InputError: The package that it is from cannot be loaded, or two packages have one of that name.
        """
        entry = self._entry(name)
        return cast(T, _load(self.own[name]) if entry is None else self._loaded(entry))

    def choose(self, name: str) -> T:
        """The entry of a name that a user gave.

        Raises:
            InputError: There is none, or see ``__getitem__``.
        """
        if name not in self:
            near = difflib.get_close_matches(name, self, n=1)
            meant = f"; did you mean {near[0]}?" if near else ""
            raise InputError(f"{self.option} {name}: unknown; available are {', '.join(self)}{meant}")
        return self[name]

    def package(self, name: str | None) -> dict[str, str]:
        """Version of the outside package that an entry is from, by its name; empty for an own one."""
        entry = None if name is None else self._entry(name)
        dist = None if entry is None else entry.dist
        return {} if dist is None else {dist.name: dist.version}

    def _outside(self) -> "list[EntryPoint]":
        from importlib.metadata import entry_points  # here: it takes 20 ms, and most commands need no names

        return list(entry_points(group=self.group))

    def _entry(self, name: str) -> "EntryPoint | None":
        """The outside entry of that name; None for an own one."""
        found = [each for each in self._outside() if each.name == name]
        if name in self.own:
            if found:
                _warn(f"{self.option} {name} is dreamdrive's own; that of {_package(found[0])} is not used")
            return None
        if not found:
            raise KeyError(name)
        if len(found) > 1:
            packages = " and ".join(sorted(map(_package, found)))
            raise InputError(f"{self.option} {name}: {packages} both have one; uninstall one of them")
        return found[0]

    def _loaded(self, entry: "EntryPoint") -> object:
        where = f"{self.option} {entry.name}: the package {_package(entry)}"
        try:
            made = entry.load()
        except Exception as error:
            raise InputError(f"{where} cannot be loaded ({type(error).__name__}: {error})") from error
        kind = cast("type[object]", _load(self.kind))
        if not isinstance(made, kind) or getattr(made, "name", None) != entry.name:
            raise InputError(f"{where} gives no {kind.__name__} called {entry.name}, but {made!r}")
        return made


def _load(place: str) -> object:
    from importlib.metadata import EntryPoint

    return EntryPoint("", place, "").load()


def _package(entry: "EntryPoint") -> str:
    return entry.value if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


@cache
def _warn(text: str) -> None:
    """Warn once."""
    _log.warning(text)


PRIORS: "Table[Prior]" = Table(
    "--prior",
    "dreamdrive.priors",
    "dreamdrive.prior:Prior",
    {
        "replay": "dreamdrive.prior.replay:REPLAY",
        "street-world": "dreamdrive.prior.street_world:STREET_WORLD",
        "photo": "dreamdrive.prior.photo:PHOTO",
        "svd": "dreamdrive.prior.vista:SVD",
        "vista": "dreamdrive.prior.vista:VISTA",
        "magicdrive": "dreamdrive.prior.magicdrive:MAGICDRIVE",
        "magicdrive-t": "dreamdrive.prior.magicdrive:MAGICDRIVE_T",
        "cosmos": "dreamdrive.prior.cosmos:COSMOS",
        "diffusers": "dreamdrive.prior.diffusers_i2v:DIFFUSERS",
    },
)
"""From a control to a clip."""
BACKENDS: "Table[GeometryBackend]" = Table(
    "--geometry",
    "dreamdrive.geometry",
    "dreamdrive.geometry:GeometryBackend",
    {
        "classical": "dreamdrive.geometry.backends.classical:CLASSICAL",
        "dust3r": "dreamdrive.geometry.backends.dust3r:DUST3R",
        "da3": "dreamdrive.geometry.backends.feedforward.da3:DA3",
        "mapanything": "dreamdrive.geometry.backends.feedforward.mapanything:MAPANYTHING",
        "vggt": "dreamdrive.geometry.backends.feedforward.vggt:VGGT",
        "pi3": "dreamdrive.geometry.backends.feedforward.pi3:PI3",
    },
)
"""From a clip to cameras and depth."""
DATASETS: "Table[DataSet]" = Table(
    "--dataset",
    "dreamdrive.datasets",
    "dreamdrive.data:DataSet",
    {
        "rig": "dreamdrive.data.rig:RIG_FOLDER",
        "nuscenes": "dreamdrive.data.nuscenes:NUSCENES",
        "pandaset": "dreamdrive.data.pandaset:PANDASET",
        "kitti-raw": "dreamdrive.data.kitti:KITTI_RAW",
        "kitti-odometry": "dreamdrive.data.kitti:KITTI_ODOMETRY",
        "recording": "dreamdrive.data.clip_reader:RECORDING",
    },
)
"""From a path to the clip of a recording, see ``data.dataset_of``."""
