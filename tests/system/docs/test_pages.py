"""Every page of docs/ and the README do what they say: their files, commands and Python."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.pages import PAGES, RUN, SHOWN, Follow, blocks, page_text, plain_commands, play

#: Pages that other modules follow, to look at what they leave behind.
FOLLOWED_ELSEWHERE = {
    "README.md": "test_readme.py",
    "docs/tutorials/beam.md": "test_readme.py",
    "docs/tutorials/hinge.md": "test_readme.py",
    "docs/tutorials/riccati-sweep.md": "test_hour.py",
    "docs/howto/define-a-hinge.md": "test_extending.py",
    "docs/howto/define-a-body.md": "test_extending.py",
    "docs/howto/define-a-force-element.md": "test_extending.py",
    "docs/howto/define-an-integration-method.md": "test_extending.py",
    "docs/howto/derivatives.md": "test_derivatives.py",
    "docs/howto/evaluate-a-model.md": "test_model.py",
    "docs/howto/flexible-bodies.md": "test_flexible.py",
    "docs/reference/scene-format.md": "test_scenes.py",
}


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if page not in FOLLOWED_ELSEWHERE])
def test_page_runs(page: str, play_page: Follow) -> None:
    play_page(page)


@pytest.mark.parametrize("page", FOLLOWED_ELSEWHERE)
def test_other_modules_follow_the_rest(page: str) -> None:
    assert page in PAGES
    text = Path(__file__).with_name(FOLLOWED_ELSEWHERE[page]).read_text("utf-8")
    assert "play_page(" in text and Path(page).name in text


@pytest.mark.parametrize("page", PAGES)
def test_every_block_says_what_it_is(page: str) -> None:
    text = page_text(page)
    found = list(blocks(text))
    fences = sum(line.strip().startswith("```") for line in text.splitlines())
    assert fences == 2 * (len(found) - text.count("<!-- run first:"))
    assert text.count("<!-- not run:") == sum(bool(block.reason) for block in found)
    for block in found:
        assert block.language in (*RUN, *SHOWN) or block.language.startswith("{"), block


PAGE = """\
`one.py`, a file:

```python
VALUE = 20
```

<!-- run first:
from pathlib import Path
value = len(Path("one.py").read_text()) + 9
-->

```python
value += 1
print(value)
```

- in a list

  ```console
  test -s one.py
  echo $((1 + 1)) > two.txt
  ```

<!-- not run: there is no network -->
```sh
exit 3
```
"""


def test_files_python_and_commands_are_followed_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.support.pages.page_text", lambda page: PAGE)
    page = play("page.md", tmp_path)
    assert page.names["value"] == 21 and page.printed == "21\n"
    assert (page.folder / "two.txt").read_text() == "2\n"
    assert [block.reason for block in blocks(PAGE)][-1] == "there is no network"


def test_commands_that_need_no_shell() -> None:
    text = "mstmm check a.toml     # the scene; or not\n\nmstmm plot a.nc -q 'b c' \\\n  -o d.png\n"
    assert plain_commands(text) == [
        ["check", "a.toml"],
        ["plot", "a.nc", "-q", "b c", "-o", "d.png"],
    ]
    for line in ("mstmm list | head", "echo mstmm", "mstmm check *.toml", "mstmm list > list.txt"):
        assert plain_commands(f"mstmm list\n{line}\n") == []


def test_a_command_or_a_line_that_fails_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "tests.support.pages.page_text", lambda page: "\n```sh\ntrue\nfalse | cat\n```\n"
    )
    with pytest.raises(AssertionError, match=r"page.md:2\ntrue\nfalse"):
        play("page.md", tmp_path)
    monkeypatch.setattr(
        "tests.support.pages.page_text", lambda page: "\n```sh\nmstmm check no.toml\n```\n"
    )
    (tmp_path / "command").mkdir()
    with pytest.raises(AssertionError, match=r"page.md:2\nmstmm check no.toml\n(.*\n)*.*no\.toml"):
        play("page.md", tmp_path / "command")
    monkeypatch.setattr(
        "tests.support.pages.page_text", lambda page: "\n\n```python\n\n1 / 0\n```\n"
    )
    (tmp_path / "again").mkdir()
    with pytest.raises(ZeroDivisionError) as met:
        play("page.md", tmp_path / "again")
    assert met.traceback[-1].lineno == 4  # counted from 0
