"""A benchmark as it is at one commit, while the checkout goes on.

    python -m dreamdrive_bench pinned COMMIT -- benchmarks/street.py --resume --json street.json

A long benchmark starts processes for hours, and each reads the code anew. Here it is the code of the commit,
checked out below ``runs/pinned`` with a core compiled from its own sources, and with an interpreter that sees
it before the packages of this one. All of that is kept for the next time. The script runs in this checkout:
``runs/street`` and other relative paths are those of every other run.
"""

import argparse
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from dreamdrive_bench.common.places import BENCH, DATA, ROOT


def git(*arguments: str, folder: Path) -> str:
    """What git answers; its own words where it fails."""
    done = subprocess.run(["git", "-C", folder, *arguments], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"git {' '.join(arguments)}: {done.stderr.strip()}")
    return done.stdout.strip()


def checked_out(commit: str, root: Path) -> Path:
    """The folder in which a commit (full hash) is checked out; refuses one with changes."""
    folder = root / "runs" / "pinned" / commit[:12]
    if not folder.exists():
        git("worktree", "add", "--force", "--detach", str(folder), commit, folder=root)
    changes = git("status", "--porcelain", folder=folder)
    if changes or git("rev-parse", "HEAD", folder=folder) != commit:
        raise SystemExit(
            f"{folder} is not what was committed: remove it with git worktree remove --force {folder}"
        )
    return folder


def build_core(folder: Path, into: Path) -> None:
    """Compile the core of a checked out commit, with the tools of this environment: minutes."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    with tempfile.TemporaryDirectory() as package:
        command = [*pip, "--no-deps", "--no-build-isolation", "--target", package, str(folder)]
        subprocess.run(command, check=True)
        for library in (Path(package) / "dreamdrive").glob("_native*.so"):
            shutil.copy(library, into)


def with_core(folder: Path) -> None:
    """Put the compiled core beside the sources of a commit; commits of the same native sources share one."""
    sources = [git("rev-parse", f"HEAD:{name}", folder=folder)[:12] for name in ("native", "CMakeLists.txt")]
    kept = folder.parent / "-".join(["core", *sources, sysconfig.get_config_var("SOABI")])
    if not kept.exists():
        print(f"compiling the core of {folder.name}", file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as made:
            (core := Path(made) / "core").mkdir()
            build_core(folder, core)
            core.rename(kept)
    for library in kept.iterdir():
        # Replaced in one step: whoever runs this commit beside us has the library in memory.
        with tempfile.TemporaryDirectory(dir=folder.parent) as made:
            copied = shutil.copy(library, made)
            os.replace(copied, folder / "src" / "dreamdrive" / library.name)


def interpreter_of(folder: Path) -> Path:
    """A Python that sees the commit first and then the packages of this one.

    Editable installations answer for their packages before any path is searched. They do so through .pth
    files, which are obeyed in their own site-packages alone, hence not here.
    """
    home = folder / ".venv"
    if not home.exists():
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", home], check=True)
    names = {"base": str(home), "platbase": str(home)}
    sources = sources_of(folder)
    third = [each for each in sys.path if Path(each).name in ("site-packages", "dist-packages")]
    paths = "".join(f"{each}\n" for each in (*sources, *third))
    (Path(sysconfig.get_path("purelib", vars=names)) / "paths.pth").write_text(paths)
    python = home / "bin" / "python"
    packages = {file.parent.name for each in sources for file in each.glob("*/__init__.py")}
    question = "import sys, importlib.util as u; print(*(u.find_spec(name).origin for name in sys.argv[1:]))"
    command = [python, "-c", question, "dreamdrive._native", *sorted(packages)]
    seen = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    if not all(Path(file).is_relative_to(folder) for file in seen):
        raise SystemExit(f"{python} takes packages from {' and '.join(seen)}; is PYTHONPATH set?")
    return python


def sources_of(folder: Path) -> list[Path]:
    """The folders of a commit that its packages are in."""
    places = ("src", "benchmarks/src", "packages/*", "packages/*/src")
    return [each for place in places for each in folder.glob(place) if any(each.glob("*/__init__.py"))]


def run(commit: str, command: list[str], root: Path = ROOT) -> int:
    """Run a script of a commit, with its arguments, and return its exit code."""
    commit = git("rev-parse", "--verify", f"{commit}^{{commit}}", folder=root)
    folder = checked_out(commit, root)
    script, *arguments = command
    if not (folder / script).is_file():
        raise SystemExit(f"{script}: {commit[:12]} has no such file (as seen from the top of the repository)")
    with_core(folder)
    python = interpreter_of(folder)
    print(f"{script} of {git('log', '-1', '--format=%h, %s', folder=folder)}", flush=True)
    environment = {**os.environ, "DREAMDRIVE_DATA": str(DATA), "DREAMDRIVE_BENCH": str(BENCH)}
    return subprocess.run([python, folder / script, *arguments], cwd=root, env=environment).returncode


def main() -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commit", help="anything that git takes for one: a hash, a branch, HEAD~2")
    parser.add_argument("command", nargs="+", metavar="SCRIPT", help="a script and, after --, its options")
    options = parser.parse_args()
    return run(options.commit, options.command)
