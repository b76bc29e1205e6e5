"""docs/options.md against the options."""

from dreamdrive.options import Options
from tests.option_page import PAGE, page, parts
from tests.snapshot import agrees


def test_the_page_is_that_of_the_options() -> None:
    agrees(PAGE, page())


def test_tables_options_and_values() -> None:
    found = list(parts("", Options()))
    assert found[0].startswith("## Above all tables")
    assert "| `representation` | `hybrid` |" in found[0]
    titles = [each.partition("\n")[0] for each in found]
    assert {"## `[geometry.depth]`", "## `[cast.placing]`", "## `[fit]`"} <= set(titles)
    fit = found[titles.index("## `[fit]`")]
    assert "| `steps` | `500` | Optimisation steps, one frame each. |" in fit
    assert "`quality`" not in found[0]
