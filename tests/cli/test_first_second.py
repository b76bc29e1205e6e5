"""What is wrong with the arguments is said before anything slow is loaded."""

import json
import subprocess
import sys
from pathlib import Path

from dreamdrive.cli.main import COMMANDS, OTHERS

HEAVY = "av", "cv2", "matplotlib", "numpy", "pandas", "pycolmap", "scipy", "shapely", "sklearn", "torch"
NESTED = {
    "evaluate": ("video", "consistency", "decomposition", "geometry", "perception"),
    "data": ("list", "check", "show"),
    "dataset": ("make",),
    "world": ("make",),
    "prior": ("sample", "features", "convert"),
    "train": ("street", "photo"),
}
WRONG = """
    generate none.mp4 -o o
    generate --prior street-world -o taken/o
    generate here -o here
    generate here -o o --options none.toml
    generate here -o o --size 4
    generate here -o o --action nowhere
    look none.jpg -o o
    look here -o here
    view none
    view here
    view here --during --port 70000
    view here --during -o taken
    render none --trajectory shift
    render here --trajectory shift --fps 0
    actors none
    actors here -o o.jpg
    edit none -o o
    edit here -o o --move 0
    edit here -o here --remove 0
    edit here -o o
    plan none
    plan here --at nan
    export none --to ply -o o
    export here --to mcap -o o.txt
    export here --to nuscenes -o here
    import none.ply -o o
    import here -o o
    clean none
    evaluate video none here
    evaluate consistency none
    evaluate decomposition none here
    evaluate geometry here --truth none
    evaluate perception --mode augment --real none --synthetic here --validation here -o o
    data list none
    data check none
    data show none -o o.png
    data show here -o o.txt
    dataset make none -o o
    dataset make here -o o --size 100x100
    world make -o o --frames 0
    world make -o here
    prior sample none.jpg -o o
    prior features none.mp4 -o o --weights w
    prior convert none.safetensors o
    train street --data none -o o
    train photo --pictures none -o o
    train restorer --drives none -o o
"""
RUN = """
import json, sys
from dreamdrive.cli.main import main
said = []
for arguments in json.loads(sys.argv[1]):
    sys.argv = ["dreamdrive", *arguments]
    try:
        main()
        code = 0
    except SystemExit as stop:
        code = stop.code
    said.append([code, sorted(set(json.loads(HEAVY)) & set(sys.modules))])
print("\\n" + json.dumps(said))
"""


def ends(place: Path, calls: list[list[str]]) -> list[tuple[str, int, list[str]]]:
    """Each call with its exit code and what of ``HEAVY`` is loaded, all in one fresh interpreter."""
    code = RUN.replace("HEAVY", repr(json.dumps(HEAVY)))
    done = subprocess.run(
        [sys.executable, "-c", code, json.dumps(calls)], capture_output=True, text=True, check=True, cwd=place
    )
    found = json.loads(done.stdout.splitlines()[-1])
    return [(" ".join(call), *end) for call, end in zip(calls, found, strict=True)]


def test_a_mistake_is_told_before_anything_slow_is_loaded(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "letter.txt").write_text("mine")
    (tmp_path / "taken").write_text("mine")
    calls = [line.split() for line in WRONG.split("\n") if line.strip()]
    assert {call[0] for call in calls} == {*COMMANDS, *OTHERS} - {"doctor"}
    assert [end for end in ends(tmp_path, calls) if end[1:] != (2, [])] == []


def test_help_and_unknown_flags_load_nothing_slow(tmp_path: Path) -> None:
    commands = [
        (name, *inner)
        for name in (*COMMANDS, *OTHERS)
        for inner in [(), *((each,) for each in NESTED.get(name, ()))]
    ]
    calls = [[], *([*command, flag] for command in commands for flag in ("--help", "--unknown"))]
    found = ends(tmp_path, calls)
    assert [end for end in found if end[2] or end[1] not in (0, 2)] == []
    assert all(code == (0 if call.endswith("--help") else 2) for call, code, _ in found if call)
