"""What a user asks ``generate`` for, checked and with everything that decides the result."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from dreamdrive.choices import DATASETS, FILL_INPAINT, FILL_NETWORK, PRIORS, QualityName
from dreamdrive.data import dataset_of, log_of
from dreamdrive.data.logs import choose_shots, files_of
from dreamdrive.errors import InputError
from dreamdrive.geometry import EXPECTED, GeometryOptions, attach, backend_of, bent_model, companions
from dreamdrive.knowledge import NO_KNOWLEDGE, SHIPPED, weights_of
from dreamdrive.models import find_weights
from dreamdrive.options import QUALITIES, Options, with_method
from dreamdrive.prior import Choice, auto_prior, choose_prior, told_of_street
from dreamdrive.progress import Work
from dreamdrive.run.stages import digest, file_digest
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.trajectory import Trajectory


@dataclass(frozen=True)
class Request:
    """What a result is made from.

    The control has the network of the prior, the options its seed; ``quality`` is their name in
    ``QUALITIES``, or ``"custom"``. Given files count by their content, of which there are digests, not by
    their place. Those for the geometry see ``geometry.backends.files``.
    """

    control: Control
    choice: Choice
    geometry_files: Path | None
    options: Options
    quality: str
    digests: dict[str, str]

    @property
    def prior(self) -> str:
        """Its name."""
        return self.choice.name

    @property
    def reading(self) -> list[object]:
        """All that the frames depend on."""
        others = {"weights"} if self.control.knowledge is not None else {"weights", "knowledge"}
        files = {name: value for name, value in self.digests.items() if name not in others}
        packages = PRIORS.package(self.prior) | DATASETS.package(self.control.dataset)
        return [self.prior, packages, self.control.settings, files, self.control.seed]

    def read(self, work: Work) -> Clip:
        """The frames, with what the geometry files say of them."""
        clip = choose_prior(self.prior)(self.control, work)
        if self.geometry_files is None:
            return clip
        return attach(clip, self.geometry_files, self.control.path)

    @property
    def document(self) -> dict[str, Any]:
        """All of it as JSON values, for the report and for telling one result from another."""
        options = asdict(self.options)
        geometry = options.pop("geometry")
        del options["seed"], geometry["weights"]
        if options["knowledge"] not in (SHIPPED, NO_KNOWLEDGE):
            options["knowledge"] = "file"
        chosen = {
            "prior": self.prior,
            "geometry": geometry.pop("method"),
            "quality": self.quality,
            **self.control.settings,
            **geometry,
            **options,
        }
        return {"digests": self.digests, "options": chosen, "seed": self.control.seed}


def request_of(
    control: Control,
    *,
    prior: str | None = None,
    geometry_files: Path | None = None,
    weights: str | Path | None = None,
    geometry_weights: str | Path | None = None,
    options: Options | QualityName = "standard",
) -> Request:
    """Check a request as far as it can be before anything is read; arguments as of ``pipeline.generate``."""
    choice = _choice_of(control, prior, weights is not None)
    prior, weights = choice.name, choice.weights if weights is None else weights
    whole = QUALITIES[options] if isinstance(options, str) else options
    control, network = _with_networks(control, prior, weights, geometry_weights or whole.geometry.weights)
    control = _with_look(control, prior, whole)
    choose_prior(prior).check(control)
    geometry = replace(whole.geometry, weights=network)
    backend_of(geometry.method, network)
    control = _with_lens(control, geometry_files)
    quality = _quality_of(whole)
    options = replace(whole, geometry=geometry, seed=control.seed)
    knowledge = None if options.knowledge == NO_KNOWLEDGE else weights_of(options.knowledge)
    digests = _digests(control, geometry_files, network, knowledge, prior=prior)
    return Request(control, choice, geometry_files, options, quality, digests)


def _choice_of(control: Control, prior: str | None, with_weights: bool) -> Choice:
    if prior is not None:
        return Choice(prior, "named")
    if control.dataset:
        return Choice("replay", "--dataset says how the recording lies on disk")
    return auto_prior(control.path, with_weights)


def _quality_of(options: Options) -> str:
    """The name of the options, whatever is chosen beside the quality."""
    g = options.geometry
    geometry = GeometryOptions(gate=g.gate, depth=g.depth, moving=g.moving, fusion=g.fusion, users=g.users)
    beside = {"representation": "hybrid", "device": "cpu", "knowledge": Options.knowledge, "seed": 0}
    plain = replace(options, geometry=geometry, **beside)
    named = {name: with_method(one, options.method) for name, one in QUALITIES.items()}
    return next((name for name, one in named.items() if one == plain), "custom")


def _with_networks(
    control: Control, prior: str, weights: str | Path | None, geometry_weights: str | Path | None
) -> tuple[Control, Path | None]:
    """The control with the prior's network, and the network of the geometry."""
    if choose_prior(prior).weights is None:
        if weights is not None and geometry_weights is not None:
            raise InputError(
                "--weights and --geometry-weights are given, but the prior "
                f"{prior} has no network; leave one out"
            )
        weights, geometry_weights = None, geometry_weights or weights
    made = control if weights is None else replace(control, weights=find_weights(weights))
    return made, None if geometry_weights is None else find_weights(geometry_weights)


def _with_look(control: Control, prior: str, options: Options) -> Control:
    """The control with what the geometry is told of the camera and asks of it, for priors that look, too."""
    told = {"knowledge": options.knowledge, "camera_height_m": options.geometry.camera_height_m}
    taken = choose_prior(prior).takes
    return replace(control, **{name: value for name, value in told.items() if name in taken})


def _with_lens(control: Control, geometry_files: Path | None) -> Control:
    """A lens in the geometry files has to be taken out of the frames when they are read."""
    if geometry_files is None or control.intrinsics is not None or control.hfov_deg is not None:
        return control
    return replace(control, intrinsics=bent_model(geometry_files))


def _digests(
    control: Control,
    geometry_files: Path | None,
    weights: Path | None,
    knowledge: Path | None = None,
    *,
    prior: str = "replay",
) -> dict[str, str]:
    asked = control.trajectory
    fill = None if control.fill in (None, FILL_NETWORK, FILL_INPAINT) else Path(control.fill)
    given = {
        "input": (control.path, "a video or a folder of images"),
        "intrinsics": (control.intrinsics, "a calibration file"),
        "poses": (control.poses, "a file with poses"),
        "trajectory": (asked if isinstance(asked, Path) else None, "a file with poses"),
        "trajectories": (control.trajectories, "a file with several paths"),
        "features": (control.features, "a .safetensors file, see docs/replay.md"),
        "prior-weights": (control.weights, "a file of weights or its folder"),
        "geometry-files": (geometry_files, EXPECTED),
        "weights": (weights, "a file of weights or its folder"),
        "knowledge": (knowledge, "weights of the street network"),
        "fill": (fill, "network, inpaint or a file of weights"),
    }
    digests: dict[str, str] = {}
    if isinstance(asked, Trajectory):
        digests["trajectory"] = digest([asked.world_from_camera.tolist(), asked.times_s.tolist()])
    for name, (path, expected) in given.items():
        if path is None:
            continue
        if not path.exists():
            flag = "" if name == "input" else f"--{name} "
            raise InputError(f"{flag}{path} does not exist; expected {expected}")
        deep = name in ("geometry-files", "prior-weights")
        if name == "input" and (taken := digest_of_log(control, prior)) is not None:
            digests[name] = taken
            continue
        if name == "input" and not (deep := dataset_of(control.dataset, path).deep):
            path = path / "frames" if (path / "frames").is_dir() else path  # as of ``data.source``
        digests[name] = file_digest(path, deep=deep)
        beside = companions(path) if name == "geometry-files" else []
        if beside:
            digests[name] = digest([digests[name], *(file_digest(each, deep=True) for each in beside)])
    return digests


def digest_of_log(control: Control, prior: str) -> str | None:
    """The digest of what a prior sees of a drive; None where the input is none.

    Those are its pictures and what is known of them, or, for priors that are conditioned on a map, its boxes,
    map, path and calibration.
    """
    log = log_of(control)
    if log is None:
        return None
    if choose_prior(prior).of_street:
        return digest(told_of_street(log))
    files, told = files_of(choose_shots(log, control.cameras, control.frames))
    return digest([told, [file_digest(file) for file in files]])
