"""What a user asks ``generate`` for, checked and with everything that decides the result."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from dreamdrive.data.input import dataset_of
from dreamdrive.data.table import DATASETS
from dreamdrive.errors import InputError
from dreamdrive.files.digest import digest, file_digest
from dreamdrive.files.given import check_given
from dreamdrive.geometry import attach, backend_of, bent_model, companions
from dreamdrive.models import find_weights
from dreamdrive.names import FILL_INPAINT, FILL_NETWORK, QualityName
from dreamdrive.options import Options, options_of
from dreamdrive.prior import PRIORS, Choice, Input, Seeing, choice_of, choose_prior
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.street_network import NO_KNOWLEDGE, SHIPPED, upright, weights_of


@dataclass(frozen=True)
class Request:
    """What a result is made from.

    The input's control has the network of the prior. Given files count by their content, of
    which there are digests, not by their place. Those for the geometry see ``geometry.backends.files``.
    """

    input: Input
    choice: Choice
    geometry_files: Path | None
    options: Options
    digests: dict[str, str]

    @property
    def prior(self) -> str:
        """Its name."""
        return self.choice.name

    @property
    def control(self) -> Control:
        """The input, and how to read it."""
        return self.input.control

    @property
    def reading(self) -> list[object]:
        """All that the frames depend on."""
        prior = self.input.prior
        others = {"weights"} if prior.looks or prior.recorded else {"weights", "knowledge"}
        files = {name: value for name, value in self.digests.items() if name not in others}
        packages = PRIORS.package(self.prior) | DATASETS.package(self.control.dataset)
        told = [self.options.geometry.camera_height_m] if prior.looks else []
        return [self.prior, packages, self.control.settings, files, self.control.seed, *told]

    def read(self, work: Work) -> Clip:
        """The frames, with what the geometry files say of them, the right way up."""
        knowledge = self.options.knowledge
        clip = self.input.clip(work, Seeing(knowledge, self.options.geometry.camera_height_m))
        if self.geometry_files is not None:
            clip = attach(clip, self.geometry_files, self.control.path)
        return upright(clip, knowledge) if self.input.prior.recorded else clip

    @property
    def document(self) -> dict[str, Any]:
        """All of it as JSON values, for the report and for telling one result from another."""
        options = asdict(self.options)
        geometry = options.pop("geometry")
        del geometry["weights"]
        if options["knowledge"] not in (SHIPPED, NO_KNOWLEDGE):
            options["knowledge"] = "file"
        chosen = {
            "prior": self.prior,
            "geometry": geometry.pop("method"),
            **self.control.settings,
            **geometry,
            **options,
            "quality": self.options.name,
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
    choice = choice_of(control, prior, weights is not None)
    prior, weights = choice.name, choice.weights if weights is None else weights
    whole = options_of(options) if isinstance(options, str) else options
    control, network = _with_networks(control, prior, weights, geometry_weights or whole.geometry.weights)
    choose_prior(prior).check(control)
    geometry = replace(whole.geometry, weights=network)
    backend_of(geometry.method, network)
    control = _with_lens(control, geometry_files)
    options = replace(whole, geometry=geometry)
    knowledge = None if options.knowledge == NO_KNOWLEDGE else weights_of(options.knowledge)
    given = _given(control, geometry_files, network, knowledge)
    opened = choose_prior(prior).open(control)
    return Request(opened, choice, geometry_files, options, _digests(opened, given))


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


def _with_lens(control: Control, geometry_files: Path | None) -> Control:
    """A lens in the geometry files has to be taken out of the frames when they are read."""
    if geometry_files is None or control.intrinsics is not None or control.hfov_deg is not None:
        return control
    return replace(control, intrinsics=bent_model(geometry_files))


def _given(
    control: Control, geometry_files: Path | None, weights: Path | None, knowledge: Path | None
) -> dict[str, Path]:
    """The files and folders that are given, all of which are there."""
    asked = control.trajectory
    fill = None if control.fill in (None, FILL_NETWORK, FILL_INPAINT) else Path(control.fill)
    given = {
        "input": control.path,
        "intrinsics": control.intrinsics,
        "poses": control.poses,
        "trajectory": asked if isinstance(asked, Path) else None,
        "trajectories": control.trajectories,
        "features": control.features,
        "prior-weights": control.weights,
        "geometry-files": geometry_files,
        "weights": weights,
        "knowledge": knowledge,
        "fill": fill,
    }
    check_given(**given)
    return {name: path for name, path in given.items() if path is not None}


def _digests(opened: Input, given: dict[str, Path]) -> dict[str, str]:
    asked, digests = opened.control.trajectory, dict[str, str]()
    if isinstance(asked, Trajectory):
        digests["trajectory"] = digest([asked.world_from_camera.tolist(), asked.times_s.tolist()])
    for name, path in given.items():
        deep = name in ("geometry-files", "prior-weights")
        if name == "input" and (taken := opened.digest) is not None:
            digests[name] = taken
            continue
        if name == "input" and not (deep := dataset_of(opened.control.dataset, path).deep):
            path = path / "frames" if (path / "frames").is_dir() else path  # as of ``data.source``
        digests[name] = file_digest(path, deep=deep)
        beside = companions(path) if name == "geometry-files" else []
        if beside:
            digests[name] = digest([digests[name], *(file_digest(each, deep=True) for each in beside)])
    return digests
