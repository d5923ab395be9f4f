"""Pages of `mstmm show` as LaTeX, compiled by pdflatex: none breaks, none leaves the text width.

Run as a program it compiles the equations of everything that can be shown.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from mstmm.cli import stored_elements
from mstmm.derive.show.schedule_page import sweep_page
from mstmm.derive.show.show_page import show_view
from mstmm.derive.show.subjects import element_view, full_names

#: What an author's document needs.
_HEAD = "\\documentclass{article}\n\\usepackage{amsmath}\n\\begin{document}\n"
#: How far a line may leave the text width unseen, points.
_UNSEEN = 3.0


def problems(pages: Iterable[tuple[str, str]]) -> list[str]:
    """What pdflatex finds wrong with named pages in one document of the plain class `article`."""
    text = "".join(f"\\typeout{{page {name}}}\n{page}\\clearpage\n" for name, page in pages)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "pages.tex"
        source.write_text(f"{_HEAD}{text}\\end{{document}}\n", encoding="utf-8")
        done = subprocess.run(
            ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", source.name],
            cwd=folder, capture_output=True, text=True, errors="replace",
        )  # fmt: skip
        written = (Path(folder) / "pages.pdf").exists()
    found, name = [], ""
    for line in done.stdout.splitlines():
        name = line.removeprefix("page ") if line.startswith("page ") else name
        wide = re.match(r"Overfull \\[hv]box \(([\d.]+)pt", line)
        if line.startswith("!") or (wide and float(wide[1]) > _UNSEEN):
            found.append(f"{name}: {line}")
    return found if done.returncode == 0 and written else [*found, "no document"]


def _page(name: str) -> tuple[str, str]:
    return name, show_view(element_view(name), "equations", "latex")


def main() -> None:
    with ProcessPoolExecutor() as workers:
        pages = list(workers.map(_page, full_names()))
    pages.append(("sweep", sweep_page("equations", "latex", stored_elements.generated_specs)))
    found = problems(pages)
    print(f"{len(pages)} pages of equations as LaTeX: {len(found)} problems", *found, sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
