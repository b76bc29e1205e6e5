import copy
import gc
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import shapely
import torch
from gymnasium.utils.env_checker import check_env

import dreamdrive.tasks.environment
from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import save_scene
from dreamdrive.tasks.environment import (
    NAMES,
    DreamDriveEnv,
    DrivableArea,
    EnvironmentOptions,
    PictureOptions,
    StartOptions,
    TrafficOptions,
    mount,
)
from tests.tasks.environment.scenes import AHEAD, BEHIND, ONCOMING, SPEED_M_S, scene, two_cameras

AS_RECORDED = EnvironmentOptions(
    start=StartOptions(share=(0, 0), aside_m=0, turned_rad=0, speed=(1, 1)),
    pictures=PictureOptions(least_weight=0.0),
)
STRAIGHT = np.zeros(2, dtype=np.float32)
SMALL = (64, 40)


def env(*scenes: Scene, **more: Any) -> DreamDriveEnv:
    settings = {"cameras": (), "options": AS_RECORDED, **more}
    return DreamDriveEnv(list(scenes) or [scene(AHEAD)], **settings)


def named(observation: dict[str, np.ndarray]) -> dict[str, float]:
    return dict(zip(NAMES, observation["vector"].tolist(), strict=True))


def driven(made: DreamDriveEnv, action: np.ndarray = STRAIGHT, **reset: Any) -> list[tuple[Any, ...]]:
    """All steps of an episode with one action."""
    made.reset(seed=0, **reset)
    steps = [made.step(action)]
    while not (steps[-1][2] or steps[-1][3]):
        steps.append(made.step(action))
    return steps


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("made") / "scene"
    save_scene(scene(AHEAD, ONCOMING), path)
    return path


@pytest.mark.parametrize("cameras", ["front", "rig", ()])
def test_it_keeps_the_rules_of_gymnasium(cameras: Any, folder: Path) -> None:
    made = gymnasium.make("DreamDrive-v0", scenes=folder, cameras=cameras, size_px=SMALL, render_mode="above")
    check_env(made.unwrapped)
    made.close()


def test_an_observation_is_what_its_space_says() -> None:
    made = env(cameras="front", size_px=SMALL)
    observation, _ = made.reset(seed=1)
    assert set(observation) == {"vector", "camera"}
    assert observation["camera"].shape == (1, 40, 64, 3)
    assert observation["vector"].shape == (len(NAMES),)
    assert observation in made.observation_space
    assert made.step(STRAIGHT)[0] in made.observation_space


def test_the_recorded_drive_can_be_driven() -> None:
    steps = driven(env())
    observation, _, terminated, truncated, info = steps[-1]
    assert (terminated, truncated, len(steps)) == (False, True, 30)
    assert info["time_s"] == pytest.approx(3.0)
    assert info["along_m"] == pytest.approx(SPEED_M_S * 3.0, abs=0.3)
    assert named(observation)["user_0_x_m"] == pytest.approx(AHEAD[0] + 1.7, abs=0.3)
    assert sum(reward for _, reward, *_ in steps) == pytest.approx(SPEED_M_S * 3.0, abs=0.4)


def test_the_camera_sees_what_the_recorded_one_saw() -> None:
    made = env(cameras="front", size_px=SMALL)
    made.reset(seed=0)
    for step in range(1, 4):
        seen = made.step(STRAIGHT)[0]["camera"][0]
        from dreamdrive.splat import render_scene

        known = scene(AHEAD)
        expected = render_scene(known, known.cameras[step], step / 10).colour.numpy() * 255
        assert np.abs(seen - expected).mean() < 3.0


def test_the_same_seed_gives_the_same_episode() -> None:
    options = EnvironmentOptions(pictures=PictureOptions(threads=1))
    made = [env(cameras="front", size_px=SMALL, options=options, traffic="react") for _ in range(2)]
    for seed in (5, None):
        (one, info), (two, other) = (each.reset(seed=seed) for each in made)
        assert info == other
        for _ in range(5):
            for name in one:
                np.testing.assert_array_equal(one[name], two[name])
            action = np.array([0.3, -0.1], dtype=np.float32)
            (one, *rest), (two, *others) = (each.step(action) for each in made)
            assert rest == others


def test_seeds_draw_starts_and_options_of_reset_fix_them() -> None:
    made = env(options=EnvironmentOptions())
    places = {made.reset(seed=seed)[1]["along_m"] for seed in range(6)}
    assert len(places) == 6
    fixed = {"start_s": 1.0, "aside_m": 0.75, "turned_rad": -0.1, "speed_m_s": 3.0}
    found = named(made.reset(seed=0, options=fixed)[0])
    assert found["aside_m"] == pytest.approx(0.75, abs=0.02)
    assert found["turned_rad"] == pytest.approx(-0.1, abs=0.01)
    assert found["speed_m_s"] == pytest.approx(3.0)
    assert found["along_m"] == pytest.approx(SPEED_M_S, abs=0.1)


def test_starts_keep_within_their_options() -> None:
    o = StartOptions(share=(0.2, 0.4), aside_m=0.3, turned_rad=0.02, speed=(0.5, 0.6))
    made = env(options=EnvironmentOptions(start=o))
    for seed in range(30):
        observation, info = made.reset(seed=seed)
        found = named(observation)
        assert 0.5 <= info["time_s"] <= 1.2 + 1e-6
        assert abs(found["aside_m"]) <= 0.31
        assert abs(found["turned_rad"]) <= 0.021
        assert 0.49 * SPEED_M_S <= found["speed_m_s"] <= 0.61 * SPEED_M_S


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"begin": 1.0}, "unknown option 'begin'"),
        ({"start_s": 9.0}, "can be entered from 0 to 2.8 s"),
        ({"scene": 3}, "expected 0 to 0"),
        ({"speed_m_s": -1.0}, "no speed below 0"),
        ({"aside_m": float("nan")}, "finite"),
        ({"aside_m": 1e300}, "aside_m and turned_rad within 10000"),
        ({"turned_rad": -1e300}, "aside_m and turned_rad within 10000"),
        ({"aside_m": 10**400}, "a finite number of each"),
        ({"scene": None}, "a finite number of each"),
        ({"scene": "first"}, "a finite number of each"),
        ({"start_s": [1.0]}, "a finite number of each"),
    ],
)
def test_what_reset_cannot_do_is_told(options: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        env().reset(seed=0, options=options)


def test_the_wall_ends_an_episode() -> None:
    steps = driven(env(), np.array([0.0, -0.5], dtype=np.float32))
    _, reward, terminated, truncated, info = steps[-1]
    assert (terminated, truncated) == (True, False)
    assert info["hit"] == "standing"
    assert info["reward"]["collision"] == -50
    assert reward < -45
    assert all(not step[4]["hit"] for step in steps[:-1])


def test_who_drives_into_the_car_ahead_has_hit_it() -> None:
    steps = driven(env(), np.array([1.0, 0.0], dtype=np.float32), options={"speed_m_s": 14.0})
    assert steps[-1][4]["hit"] == "actor 0"
    assert steps[-1][2]


def test_far_from_the_path_is_off_the_road_where_no_map_tells() -> None:
    steps = driven(env(scene()), np.array([0.0, 0.4], dtype=np.float32))
    info = steps[-1][4]
    assert steps[-1][2]
    assert info["off_road"]
    assert info["aside_m"] > 4.0
    assert info["reward"]["off_road"] == -50


def test_a_map_tells_where_the_road_ends() -> None:
    road = DrivableArea(shapely.box(-20, -2.0, 200, 2.0))
    steps = driven(env(scene(), roads=road), np.array([0.0, 0.4], dtype=np.float32))
    assert steps[-1][4]["off_road"]
    assert 0.4 < steps[-1][4]["aside_m"] < 2.6
    with pytest.raises(InputError, match="roads: 2 for 1 scenes"):
        env(scene(), roads=[road, None])


def test_an_episode_ends_after_its_steps_or_behind_the_path() -> None:
    assert len(driven(env(options=EnvironmentOptions(start=AS_RECORDED.start, max_steps=7)))) == 7
    fast = EnvironmentOptions(start=AS_RECORDED.start, beyond_m=2.0)
    steps = driven(env(scene(), options=fast), options={"speed_m_s": 20.0})
    assert steps[-1][3]
    assert 26 < steps[-1][4]["along_m"] < 28.5


def test_beyond_the_recorded_time_what_moved_moves_on() -> None:
    options = EnvironmentOptions(start=AS_RECORDED.start, beyond_s=2.0, pictures=AS_RECORDED.pictures)
    made = env(cameras="front", size_px=SMALL, options=options)
    steps = driven(made)
    assert len(steps) == 50
    assert named(steps[-1][0])["user_0_x_m"] == pytest.approx(AHEAD[0] + 1.7, abs=0.5)
    # The car ahead keeps its distance, so that it stays where it was in the picture.
    before, after = (steps[step][0]["camera"][0].astype(float) for step in (28, 48))
    lead = np.s_[21:24, 30:34]
    assert np.abs(before[lead] - after[lead]).mean() < 12
    gone = driven(env(scene(), cameras="front", size_px=SMALL, options=options))[48][0]["camera"][0]
    assert np.abs(gone[lead].astype(float) - after[lead]).mean() > 12


def test_traffic_reacts_if_told() -> None:
    # The one behind would drive into a car that brakes.
    brake = np.array([-1.0, 0.0], dtype=np.float32)
    longer = EnvironmentOptions(start=AS_RECORDED.start, beyond_s=4.0)
    assert driven(env(scene(BEHIND), options=longer), brake)[-1][4]["hit"] == "actor 0"
    made = env(scene(BEHIND), options=longer, traffic="react", cameras="front", size_px=SMALL)
    last = driven(made, brake)[-1]
    assert last[4]["hit"] == ""
    assert last[3]


def test_scenes_are_drawn_by_the_seed_and_few_are_kept(folder: Path, tmp_path: Path) -> None:
    save_scene(scene(), tmp_path / "out" / "scene")
    made = DreamDriveEnv([folder, tmp_path / "out"], cameras=(), options=EnvironmentOptions(keep=1))
    drawn = [made.reset(seed=seed)[1]["scene"] for seed in range(12)]
    assert set(drawn) == {str(folder), str(tmp_path / "out" / "scene")}
    assert drawn == [made.reset(seed=seed)[1]["scene"] for seed in range(12)]
    assert len(made._courses._loaded) == 1
    assert made.reset(seed=0, options={"scene": 1})[1]["scene"] == str(tmp_path / "out" / "scene")


def test_any_cameras_will_do() -> None:
    mounts = [mount("left", left_deg=55, size_px=SMALL), mount("right", left_deg=-55, size_px=SMALL)]
    observation, _ = env(cameras=mounts).reset(seed=0)
    assert observation["camera"].shape == (2, 40, 64, 3)
    rig = env(two_cameras(scene()), cameras="rig", size_px=SMALL)
    assert rig.reset(seed=0)[0]["camera"].shape == (2, 40, 64, 3)
    unequal = env(two_cameras(scene()), scene(), cameras="rig", size_px=SMALL)
    with pytest.raises(InputError, match="1 cameras, the first scene 2"):
        unequal.reset(seed=0, options={"scene": 1})
    with pytest.raises(InputError, match="one size"):
        env(cameras=[mounts[0], mount("large")])


@pytest.mark.parametrize("mode", ["rgb_array", "above"])
@pytest.mark.parametrize("cameras", ["front", ()])
def test_it_can_be_looked_at(mode: Any, cameras: Any) -> None:
    made = env(cameras=cameras, size_px=SMALL, render_mode=mode)
    observation, _ = made.reset(seed=0)
    picture = made.render()
    assert picture is not None
    assert picture.dtype == np.uint8
    assert picture.std() > 5
    if mode == "rgb_array" and cameras:
        np.testing.assert_array_equal(picture, observation["camera"][0])
    assert env().render() is None


def test_from_above_the_car_points_up_with_the_wall_to_its_right() -> None:
    road = DrivableArea(shapely.box(-20, -3.0, 200, 3.0))
    made = env(scene(AHEAD), roads=road, render_mode="above")
    made.reset(seed=0)
    picture = made.render()
    assert picture is not None
    column = {
        name: np.argwhere((picture == colour).all(-1))[:, 1].mean()
        for name, colour in {"ego": (210, 30, 60), "user": (70, 150, 255), "wall": (255, 160, 40)}.items()
    }
    row = {
        name: np.argwhere((picture == colour).all(-1))[:, 0].mean()
        for name, colour in {"ego": (210, 30, 60), "user": (70, 150, 255)}.items()
    }
    assert column["wall"] > column["ego"] + 15
    assert abs(column["user"] - column["ego"]) < 3
    assert row["user"] < row["ego"] - 40
    assert (picture == (58, 60, 66)).all(-1).mean() > 0.03


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_many_at_once(mode: str, folder: Path) -> None:
    settings = {
        "scenes": folder,
        "size_px": SMALL,
        "options": EnvironmentOptions(pictures=PictureOptions(threads=1)),
    }
    made = gymnasium.make_vec("DreamDrive-v0", num_envs=2, vectorization_mode=mode, **settings)
    try:
        observation, _ = made.reset(seed=3)
        assert observation["camera"].shape == (2, 1, 40, 64, 3)
        assert not np.array_equal(observation["vector"][0], observation["vector"][1])
        alone = gymnasium.make("DreamDrive-v0", **settings)
        np.testing.assert_array_equal(alone.reset(seed=4)[0]["camera"], observation["camera"][1])
        actions = np.tile(STRAIGHT, (2, 1))
        after, reward, *_ = made.step(actions)
        expected = alone.step(STRAIGHT)
        np.testing.assert_array_equal(after["vector"][1], expected[0]["vector"])
        assert reward[1] == pytest.approx(expected[1])
        for _ in range(40):  # beyond the end of the episodes
            after, *_ = made.step(actions)
        assert after in made.observation_space
    finally:
        made.close()


def test_forked_ones_do_not_wait_for_threads_that_torch_had(folder: Path) -> None:
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        torch.zeros(1 << 20).abs()  # begins the threads
        made = gymnasium.make_vec(
            "DreamDrive-v0", num_envs=2, vectorization_mode="async", scenes=folder, cameras=()
        )
        assert isinstance(made, gymnasium.vector.AsyncVectorEnv)
        made.reset_async(seed=3)
        made.reset_wait(timeout=60)
        made.close(terminate=True)
    finally:
        torch.set_num_threads(before)


def test_what_is_given_is_not_changed_by_who_keeps_it() -> None:
    made = env(cameras="front", size_px=SMALL)
    observation, _ = made.reset(seed=0)
    kept = copy.deepcopy(observation)
    made.step(np.array([1.0, 0.5], dtype=np.float32))
    for name, value in kept.items():
        np.testing.assert_array_equal(observation[name], value)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"traffic": "wild"}, "expected recorded or react"),
        ({"cameras": "back"}, "expected front, rig"),
        ({"render_mode": "human"}, "expected rgb_array, above"),
        ({"scenes": []}, "none given"),
        ({"scenes": "nowhere"}, "nowhere holds no scene"),
        *(
            ({"size_px": size}, "expected width and height, whole numbers from 1 to 16384")
            for size in ((0, 0), (-1, 5), (100_000, 2), (16_000, 16_000))
        ),
    ],
)
def test_what_cannot_be_made_is_told(wrong: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        DreamDriveEnv(**{"scenes": scene(), **wrong})


@pytest.mark.parametrize(
    "action", [[0.0], [0.0, np.nan], [np.inf, 0.0], [0.0] * 3, [[0.0, 0.0]], 0.0, None, "ab", [10**400, 0]]
)
def test_an_action_is_two_finite_numbers(action: Any) -> None:
    made = env()
    made.reset(seed=0)
    with pytest.raises(InputError, match="two finite numbers"):
        made.step(np.array(action))


def test_an_action_beyond_the_ends_is_the_end() -> None:
    found = [driven(env(), np.array(action))[:3] for action in ([9.0, -1e300], [1.0, -1.0])]
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one[0]["vector"], other[0]["vector"])


def test_an_episode_has_to_begin() -> None:
    made = env(render_mode="above")
    for asked in (lambda: made.step(STRAIGHT), made.render):
        with pytest.raises(gymnasium.error.ResetNeeded, match="call reset first"):
            asked()


@pytest.mark.filterwarnings("ignore:.*ERROR. ")  # gymnasium says at length what it then raises
@pytest.mark.parametrize("mode", ["sync", "async"])
def test_many_at_once_say_what_one_says(mode: str, folder: Path) -> None:
    made = gymnasium.make_vec("DreamDrive-v0", num_envs=2, vectorization_mode=mode, scenes=folder, cameras=())
    try:
        with pytest.raises(InputError, match=r"start_s 99: .* can be entered from 0 to 2\.8 s"):
            made.reset(seed=1, options={"start_s": 99})
    finally:
        made.close()


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: EnvironmentOptions(step_s=0.0),
        lambda: EnvironmentOptions(max_steps=1),
        lambda: EnvironmentOptions(keep=0),
        lambda: StartOptions(share=(0.5, 0.2)),
        lambda: StartOptions(speed=(-1.0, 1.0)),
        lambda: StartOptions(turned_rad=2.0),
        lambda: TrafficOptions(look_m=-1.0),
        lambda: TrafficOptions(look_m=1e9),
        lambda: EnvironmentOptions(beyond_m=1e9),
        lambda: PictureOptions(threads=0),
    ],
)
def test_options_of_no_use_are_refused(wrong: Any) -> None:
    with pytest.raises(InputError, match="expected"):
        wrong()


def test_a_scene_of_two_steps_is_too_short() -> None:
    with pytest.raises(InputError, match="shorter than two steps"):
        env(scene(seconds=0.1)).reset(seed=0)


def test_it_is_found_by_its_module() -> None:
    assert "DreamDrive-v0" in gymnasium.registry
    made = gymnasium.make("dreamdrive.tasks.environment:DreamDrive-v0", scenes=scene(), cameras=())
    assert isinstance(made.unwrapped, dreamdrive.tasks.environment.DreamDriveEnv)


def test_without_gymnasium_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [each for each in sys.modules if each.startswith("dreamdrive.tasks.environment")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(ImportError, match=r"pip install -e '\.\[environment\]'"):
        __import__("dreamdrive.tasks.environment")


@pytest.mark.slow
@pytest.mark.parametrize(("cameras", "steps"), [((), 10_000), ([mount("tiny", size_px=(16, 12))], 2000)])
def test_thousands_of_steps_take_no_more_memory(cameras: Any, steps: int) -> None:
    options = EnvironmentOptions(pictures=PictureOptions(cache_mb=1.0), beyond_s=1.0)
    made = env(scene(AHEAD, BEHIND), cameras=cameras, options=options, traffic="react")
    rng = np.random.default_rng(0)

    def drive(steps: int) -> None:
        made.reset(seed=int(rng.integers(100)))
        for _ in range(steps):
            *_, terminated, truncated, _ = made.step(rng.uniform(-1, 1, 2).astype(np.float32))
            if terminated or truncated:
                made.reset()

    drive(1000)
    objects, resident_mb = _in_memory()
    drive(steps)
    more, after_mb = _in_memory()
    assert more - objects < 1000
    assert after_mb - resident_mb < 20


def _in_memory() -> tuple[int, float]:
    """Objects of Python, and megabytes of the process."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return len(gc.get_objects()), pages * 4096 / 1e6


def test_how_far_the_picture_can_be_believed_is_in_the_info() -> None:
    street = scene(AHEAD)
    camera = street.cameras[0]
    blocks = len(street.cameras), camera.height_px // 8, camera.width_px // 8
    known = replace(street, residual=np.full(blocks, 0.02, np.float16))
    options = replace(AS_RECORDED, trust=True)
    made = env(known, options=options)
    _, on_path = made.reset(seed=0, options={"start_s": 0.5, "aside_m": 0.0})
    _, aside = made.reset(seed=0, options={"start_s": 0.5, "aside_m": 3.0})
    assert aside["expected_psnr_db"] < on_path["expected_psnr_db"] - 1
    info = made.step(STRAIGHT)[-1]
    assert info["expected_psnr_db"] > 0
    assert "expected_psnr_db" not in env(known).reset(seed=0)[1]
    with pytest.raises(InputError, match="off its frames"):
        env(street, options=options).reset(seed=0)
