"""HTML pages: one file without scripts or network access, in one style."""

from __future__ import annotations

from .display import text

_STYLE = """
html { color-scheme: light; --ink: #1b1f24; --soft: #57606a; --line: #d5dae0; --page: #fdfdfc;
  --block: #f4f6f8; --accent: #0a5a8a; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 16px/1.55 "Source Serif 4", Charter, Georgia, "Times New Roman", serif; }
main { max-width: 62rem; margin: 0 auto; padding: 2.5rem 1.5rem 4rem; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .3rem; overflow-wrap: anywhere; }
h2 { font-size: 1.25rem; margin: 2.4rem 0 .8rem; padding-top: .8rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.6rem 0 .5rem; color: var(--accent); }
p { margin: .4rem 0; } .soft { color: var(--soft); font-size: .92rem; }
a { color: var(--accent); } ul { padding-left: 1.2rem; margin: .4rem 0; } li { margin: .2rem 0; }
details { margin: .6rem 0; } summary { cursor: pointer; color: var(--accent); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .93rem; }
th { text-align: left; font-weight: 600; color: var(--soft); }
th, td { padding: .28rem .9rem .28rem 0; border-bottom: 1px solid var(--line);
  vertical-align: baseline; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
pre { background: var(--block); border-radius: 6px; padding: .9rem 1rem; overflow-x: auto;
  font: 13px/1.5 "JetBrains Mono", "DejaVu Sans Mono", Menlo, Consolas, monospace; }
@media (max-width: 40rem) { main { padding: 1rem .8rem 2rem; } table { font-size: .85rem; } }
@media print { html { --ink: #000; --soft: #444; --line: #bbb; --page: #fff; --block: #fff;
    --accent: #000; }
  body { font-size: 11pt; } main { max-width: none; padding: 0; } .wide { overflow: visible; }
  pre { white-space: pre-wrap; font-size: 7pt; } h2, h3 { break-after: avoid; } }
"""

#: For pages without pictures, which need a white background.
_DARK_STYLE = """
@media screen and (prefers-color-scheme: dark) { html { color-scheme: dark; --ink: #e3e6ea;
  --soft: #9aa4af; --line: #363c44; --page: #15181c; --block: #1e2227; --accent: #6fb5e0; } }
"""


def html_page(
    title: str, body: str, style: str = "", *, dark: bool = False, policy: str = ""
) -> str:
    """Complete page of a body, which is HTML.

    Args:
        title: title of the window, plain text.
        body: contents, escaped.
        style: rules in addition to the common ones.
        dark: whether the colours follow a dark mode of the reader.
        policy: content security policy, without one if empty.
    """
    rules = f"{_STYLE}{_DARK_STYLE if dark else ''}{style}"
    head = f'<meta http-equiv="Content-Security-Policy" content="{policy}"/>\n' if policy else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n{head}'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{text(title)}</title>\n<style>{rules}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )
