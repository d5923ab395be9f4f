"""HTML page of a report: one file, whose security policy allows no external content."""

from __future__ import annotations

from collections.abc import Sequence

from ...notebook_html import text

#: Nothing is loaded from elsewhere: scripts and pictures are part of the page.  The animation needs
#: 'unsafe-eval' for the decoder of viser, which is compiled to WebAssembly.
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; worker-src blob:; "
    "connect-src data: blob:; frame-src 'self'"
)

STYLE = """
.verdict { border-left: .45rem solid var(--mark); background: var(--block); padding: .7rem 1rem;
  border-radius: 4px; margin: 1rem 0; } .verdict b { color: var(--mark); }
.good { --mark: #2d7d46; } .open { --mark: #a06a00; } .bad { --mark: #b3261e; }
.wide { overflow-x: auto; } nav { font-size: .92rem; } nav a { margin-right: 1.1em; }
table.rows { border-collapse: collapse; font-size: .93rem; }
table.rows th { text-align: left; font-weight: 600; color: var(--soft); white-space: nowrap; }
table.rows th, table.rows td { padding: .28rem 1rem .28rem 0; vertical-align: baseline;
  border-bottom: 1px solid var(--line); }
:root { color-scheme: light; }
iframe { width: 100%; height: 30rem; border: 1px solid var(--line); border-radius: 6px; }
.strip img { width: 100%; height: auto; } .curves { min-height: 10rem; overflow: hidden; }
ul { padding-left: 1.2rem; margin: .4rem 0; } li { margin: .2rem 0; }
details { margin: .6rem 0; } summary { cursor: pointer; color: var(--accent); }
details > h1 { font-size: 1.2rem; margin-top: .8rem; }
a { color: var(--accent); }
@media (max-width: 40rem) {
  .long tr { display: grid; grid-template-columns: repeat(3, auto); border-bottom: 1px solid
    var(--line); padding: .2rem 0; }
  .long tr > :last-child { grid-column: 1 / -1; } .long tr > * { border: 0 !important; }
}
"""


def section_html(name: str, title: str, body: str) -> str:
    """Section of the page with its heading; `name` is the target of links."""
    return f'<section id="{name}"><h2>{text(title)}</h2>\n{body}</section>'


def page_html(title: str, style: str, sections: Sequence[tuple[str, str, str]], head: str) -> str:
    """Build the whole page from sections (name, title, body); empty bodies are left out."""
    filled_sections = [entry for entry in sections if entry[2]]
    links = "".join(
        f'<a href="#{name}">{text(heading)}</a>' for name, heading, _ in filled_sections
    )
    body = "\n".join(section_html(*entry) for entry in filled_sections)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        f'<meta http-equiv="Content-Security-Policy" content="{CONTENT_SECURITY_POLICY}"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{text(title)}</title>\n<style>{style}{STYLE}</style>\n</head>\n<body>\n<main>\n"
        f"<h1>{text(title)}</h1>\n{head}\n<nav>{links}</nav>\n{body}\n</main>\n</body>\n</html>\n"
    )
