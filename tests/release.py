"""What a version is called in all places that name it."""

import re

RELEASED = re.compile(r"^## (\d\S*) \((\d{4}-\d{2}-\d{2})\)$", re.MULTILINE)


def disagreements(changelog: str, project: str, package: str, tags: list[str]) -> list[str]:
    """Why a commit is no release of its version, in sentences; none where all agree.

    Args:
        changelog: The text of CHANGELOG.md.
        project: The version in pyproject.toml.
        package: ``dreamdrive.__version__``.
        tags: Tags of this commit.
    """
    released = RELEASED.findall(changelog)
    newest = released[0][0] if released else "none"
    versions = [tag for tag in tags if tag.startswith("v")]
    found = [
        (package != project, f"the package says {package}, pyproject.toml {project}"),
        (newest != project, f"the newest release in CHANGELOG.md is {newest}, pyproject.toml says {project}"),
        (bool(versions) and versions != [f"v{project}"], f"tagged {' '.join(versions)}, expected v{project}"),
        (bool(versions) and "## Unreleased" in changelog, "tagged with changes that are called unreleased"),
    ]
    return [words for wrong, words in found if wrong]
