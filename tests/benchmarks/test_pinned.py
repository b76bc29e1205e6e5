"""A script runs as it is at a commit, whatever the checkout has become."""

import subprocess
from pathlib import Path

import pytest

from dreamdrive_bench import pinned

SCRIPT = """
import sys
from pathlib import Path
import dreamdrive
import dreamdrive_bench
Path("runs/said.txt").write_text(" ".join([dreamdrive.WORD + dreamdrive_bench.WORD, *sys.argv[1:]]))
sys.exit(3)
"""


def commit(root: Path, word: str) -> str:
    """The repository with another word in its package, committed."""
    for package in ("src/dreamdrive", "benchmarks/src/dreamdrive_bench"):
        (root / package / "__init__.py").write_text(f"WORD = {word!r}\n")
    author = ["-c", "user.name=A", "-c", "user.email=a@example.org"]
    for arguments in (["add", "-A"], [*author, "commit", "-q", "-m", word]):
        subprocess.run(["git", "-C", root, *arguments], check=True)
    return pinned.git("rev-parse", "HEAD", folder=root)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for folder in ("src/dreamdrive", "native", "benchmarks/src/dreamdrive_bench", "runs"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "native/core.cpp").touch()
    (tmp_path / "CMakeLists.txt").touch()
    (tmp_path / ".gitignore").write_text("/runs/\n.venv/\n__pycache__/\n_native.py\n")
    (tmp_path / "benchmarks/say.py").write_text(SCRIPT)
    subprocess.run(["git", "init", "-q", tmp_path], check=True)
    return tmp_path


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The checkouts whose core was compiled: an empty module stands for it."""
    folders: list[Path] = []

    def build(folder: Path, into: Path) -> None:
        folders.append(folder)
        (into / "_native.py").touch()

    monkeypatch.setattr(pinned, "build_core", build)
    return folders


def test_the_code_is_that_of_the_commit_and_the_results_lie_in_the_checkout(
    root: Path, built: list[Path], capfd: pytest.CaptureFixture[str]
) -> None:
    first, second = commit(root, "old"), commit(root, "new")
    (root / "src/dreamdrive/__init__.py").write_text("WORD = 'changed'\n")
    (root / "benchmarks/src/dreamdrive_bench/__init__.py").write_text("WORD = 'changed'\n")
    for word, name in (("old", first), ("new", "HEAD"), ("old", first[:10])):
        assert pinned.run(name, ["benchmarks/say.py", "--resume"], root) == 3
        assert (root / "runs/said.txt").read_text() == f"{2 * word} --resume"
        assert f"benchmarks/say.py of {pinned.git('rev-parse', '--short', name, folder=root)}, {word}" in (
            capfd.readouterr().out
        )
    assert {path.name for path in (root / "runs/pinned").iterdir()} >= {first[:12], second[:12]}
    assert len(built) == 1  # the native sources are the same


def test_other_native_sources_have_a_core_of_their_own(root: Path, built: list[Path]) -> None:
    first = commit(root, "old")
    (root / "native/core.cpp").write_text("// faster\n")
    second = commit(root, "new")
    for name in (first, second):
        pinned.run(name, ["benchmarks/say.py"], root)
    assert [folder.name for folder in built] == [first[:12], second[:12]]


def test_what_is_not_the_commit_is_refused(root: Path, built: list[Path]) -> None:
    name = commit(root, "old")
    with pytest.raises(SystemExit, match=r"say_more\.py: .* has no such file"):
        pinned.run(name, ["benchmarks/say_more.py"], root)
    with pytest.raises(SystemExit, match="rev-parse"):
        pinned.run("no-such-branch", ["benchmarks/say.py"], root)
    (root / "runs/pinned" / name[:12] / "benchmarks/say.py").write_text("")
    with pytest.raises(SystemExit, match="git worktree remove --force"):
        pinned.run(name, ["benchmarks/say.py"], root)
