from dataclasses import fields, replace
from math import nan

import numpy as np
import pytest
import torch

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive_train.street_network.data.colours import ColourOptions, exchanged, recoloured
from dreamdrive_train.street_network.data.loader import Loader, LoaderOptions
from dreamdrive_train.street_network.data.mixture import Mixture, read_entries
from dreamdrive_train.street_network.data.picture import Picture
from dreamdrive_train.street_network.targets import Batch, batch_of
from tests.records import write_bare, write_folder

SMALL = LoaderOptions(batch=4, sizes=((96, 64), (64, 64)))


@pytest.fixture(scope="module")
def mixture(tmp_path_factory: pytest.TempPathFactory) -> Mixture:
    folder = tmp_path_factory.mktemp("records")
    write_folder(folder / "drawn", range(1_000_000, 1_000_002))
    write_bare(folder / "real")
    return Mixture.of(read_entries([folder / "drawn", folder / "real"]), {})


def same(one: Batch, other: Batch) -> bool:
    pairs = [(getattr(one, each.name), getattr(other, each.name)) for each in fields(Batch)]
    return all(a.shape == b.shape and torch.equal(a.nan_to_num(), b.nan_to_num()) for a, b in pairs)


def test_a_batch_follows_from_seed_and_step(mixture: Mixture) -> None:
    loader = Loader(mixture, SMALL, 3)
    assert same(loader.batch(5), loader.batch(5))
    assert not same(loader.batch(5), loader.batch(6))
    assert not same(loader.batch(5), Loader(mixture, SMALL, 4).batch(5))


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_thread_and_processes_give_the_same_batches_in_order(mixture: Mixture, workers: int) -> None:
    loader = Loader(mixture, replace(SMALL, workers=workers), 0)
    made = list(loader.batches(2, 5))
    assert len(made) == 5
    assert all(same(batch, loader.batch(2 + k)) for k, batch in enumerate(made))


def test_batches_are_of_the_sizes_and_mix_the_sources(mixture: Mixture) -> None:
    batches = list(Loader(mixture, SMALL, 0).batches(0, 12))
    assert {tuple(each.pictures.shape[2:]) for each in batches} == {(64, 96), (64, 64)}
    for batch in batches:
        height, width = batch.pictures.shape[2:]
        assert batch.taught.sum() == 2
        assert len(batch.clean) == 2
        assert batch.labels.shape[1:] == (height // 2, width // 2)
        assert batch.centre.shape[2:] == (height // 4, width // 4)
        assert (batch.labels[batch.taught] == 255).all()
        assert (batch.depth_m[batch.taught] == 0).all()
        assert batch.camera[batch.taught].isnan().all()


def test_cuts_away_from_the_middle_leave_the_camera_unknown(mixture: Mixture) -> None:
    aside = next(Loader(mixture, replace(SMALL, aside_share=1.0), 0).batches(0, 1))
    assert aside.camera.isnan().all()
    assert aside.camera_height_m.isnan().all()
    middle = next(Loader(mixture, replace(SMALL, aside_share=0.0), 0).batches(0, 1))
    assert middle.camera[~middle.taught].isfinite().all()


def test_offsets_lead_to_the_peak() -> None:
    instances = np.zeros((32, 48), np.uint8)
    labels = np.full((32, 48), StreetClass.ROAD, np.uint8)
    instances[4:20, 10:30], labels[4:20, 10:30] = 3, StreetClass.VEHICLE
    instances[22:30, 40:44], labels[22:30, 40:44] = 9, 34  # some road user, no telling which
    instances[0, :], labels[0, :] = 255, 255
    rgb = np.zeros((64, 96, 3), np.uint8)
    picture = Picture(rgb, labels, instances, instances.astype(np.uint16), nan, nan, nan, nan, nan)
    batch = batch_of([picture], [False], [])
    (channel, row, column), *others = torch.nonzero(batch.centre[0] == 1).tolist()
    assert (channel, row, column, others) == (0, 6, 10, [])
    rows, columns = torch.nonzero(batch.on_road_user[0, :10], as_tuple=True)
    aimed = torch.stack([columns, rows]) + 0.5 + batch.offset[0][:, rows, columns] / 4
    torch.testing.assert_close(aimed, torch.tensor([[10.0], [6.0]]).expand_as(aimed))
    known = batch.centre_known[0]
    assert not known[0].any()
    assert not known[11:15, 20:22].any()
    assert known[1:11].all()


def test_colours_change_and_the_shape_stays() -> None:
    rgb = np.random.default_rng(0).integers(0, 255, (64, 96, 3), np.uint8)
    made = [recoloured(rgb, np.random.default_rng(seed), ColourOptions()) for seed in range(20)]
    assert all(each.shape == rgb.shape and each.dtype == np.uint8 for each in made)
    assert len({each.tobytes() for each in made}) == 20


def test_the_exchange_takes_the_mean_of_the_other_and_keeps_the_detail() -> None:
    rng = np.random.default_rng(0)
    rgb = rng.integers(80, 120, (64, 64, 3), np.uint8)
    light = np.full((64, 64, 3), 180, np.uint8)
    made = exchanged(rgb, light, 2)
    assert made.mean() == pytest.approx(180, abs=2)
    detail = rgb - rgb.mean(axis=(0, 1))
    assert np.corrcoef(detail.ravel(), (made - made.mean(axis=(0, 1))).ravel())[0, 1] > 0.9
