"""Files are written whole or not at all, and never through links."""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mstmm.errors import EnvironmentFailure
from mstmm.runtime.platform_support.safe_files import write_text


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """No room for more than `size` bytes in a file."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_the_old_file_stays_where_there_is_no_room(tmp_path: Path) -> None:
    path = tmp_path / "page.txt"
    write_text(path, "old")
    with files_of_at_most(1000), pytest.raises(EnvironmentFailure, match=r"page\.txt.*written"):
        write_text(path, "new" * 1000)
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["page.txt"]


def test_a_link_is_replaced_and_what_it_names_stays(tmp_path: Path) -> None:
    precious, link = tmp_path / "precious", tmp_path / "link"
    precious.write_text("precious")
    link.symlink_to(precious)
    write_text(link, "page")
    assert precious.read_text() == "precious" and not link.is_symlink()
    assert link.read_text() == "page"
