"""Which part is worth what: the same frames fitted in other ways, judged by frames that no fit has seen.

    python examples/06_compare_methods.py [CLIP] [--out DIR]

`Options` holds every constant of every stage. A quality is one `Options`; `replace` changes any field of
it, and `report.json` says what each result was made with. Here the whole method is compared with a fit in
which nothing moves, and with one that does without the street network.

Without a clip the small street is used: a minute on two cores.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from small import small_street

from dreamdrive import Control, generate
from dreamdrive.options import QUALITIES


def main() -> None:
    """Make three scenes and print a line for each."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("clip", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/06_compare_methods"))
    given = arguments.parse_args()

    draft = QUALITIES["draft"]
    ways = {
        "hybrid": draft,
        "static": replace(draft, representation="static"),
        "no_network": replace(draft, knowledge="none"),
    }
    clip = given.clip or small_street(given.out.parent)
    for name, options in ways.items():
        control = Control(clip, fps=10, hold_out=4)
        outcome = generate(control, given.out / name, options=options)
        print(f"{name:10}  {outcome.psnr:5.2f} dB on {outcome.held_out} held-out frames")


if __name__ == "__main__":
    main()
