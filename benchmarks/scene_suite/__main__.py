"""Cost charts of eight scenes: CPU time over achieved error, compared with other programs.

    python -m benchmarks.scene_suite [SCENE ...] [--rounds N] [--budget S] [--quick] [--plot]

Each scene is charted as `mstmm chart` does it: every method of mstmm over its tolerances or steps
against a reference of known error, on both engines; the error is that of the final position of one
end, m.  Other programs run the same scene against the same reference.  Then the cheapest settings
of all programs are timed in alternating rounds of one process: minimum CPU time of one whole warm
call that returns the final state.
"""

from __future__ import annotations

import json
import os
import warnings
from argparse import ArgumentParser
from pathlib import Path

from ..common import measure
from .cases import CASES
from .comparison import Limits, compare
from .report import page, table

HERE = Path(__file__).resolve().parent
DOCS = HERE.parents[1] / "docs"


def command_parser() -> ArgumentParser:
    """Parser of the command line."""
    parser = ArgumentParser(
        "python -m benchmarks.scene_suite", description=str(__doc__).split("\n")[0]
    )
    parser.add_argument("scene", nargs="*", help=f"of {', '.join(CASES)}; all unless given")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of result.json, .md, .png")
    parser.add_argument("--rounds", type=int, default=Limits.rounds, help="alternating rounds")
    parser.add_argument("--budget", type=float, default=Limits.budget,
                        help="clock s of mstmm's settings, for each scene")  # fmt: skip
    parser.add_argument("--limit", type=float, default=Limits.run,
                        help="CPU s of a run of another program that ends its curve")  # fmt: skip
    parser.add_argument("--methods", default="", help="mstmm's, by name, with commas; all of them")
    parser.add_argument("--no-peers", action="store_true", help="mstmm only")
    parser.add_argument(
        "--quick", action="store_true", help="few settings and rounds, to test the script"
    )
    parser.add_argument("--plot", action="store_true", help="pages from the stored JSON")
    return parser


def main(arguments: list[str] | None = None) -> None:
    """Measure; write result.json, result.md and the picture after every scene."""
    parser = command_parser()
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.scene if name not in CASES]:
        parser.error(f"no scene {unknown[0]!r}; there are {', '.join(CASES)}")
    methods = tuple(name for name in options.methods.split(",") if name)
    limits = Limits(options.budget, options.limit, options.rounds, 1, methods)
    if options.quick:
        limits = Limits(min(5.0, options.budget), 0.2, 1, 4, methods)
    file = options.out / "result.json"
    stored = {}
    if file.exists():
        stored = {result["case"]: result for result in json.loads(file.read_text())["results"]}
    warnings.simplefilter("ignore")  # of integrators with difficulties
    for name in [] if options.plot else options.scene or list(CASES):
        stored[name] = compare(
            CASES[name], limits, not options.no_peers, lambda text: print(text, flush=True)
        )
        print(
            *(f"{name}: left out: {reason}" for reason in stored[name]["missing"]),
            sep="\n",
            flush=True,
        )
        results = [stored[result] for result in CASES if result in stored]
        measure.save_record(file, results, unit="CPU ms of one run", rounds=limits.rounds)
    record = json.loads(file.read_text())
    print(table(record))
    pages = [(options.out / "result.md", options.out / "result.png")]
    if options.out == HERE:
        pages.append(
            (DOCS / "benchmarks" / "scene-comparison.md", DOCS / "images" / "standing.png")
        )
    from .picture import draw

    for text, picture in pages:
        draw(record, picture)
        text.write_text(page(record, os.path.relpath(picture, text.parent)), encoding="utf-8")


if __name__ == "__main__":
    main()
