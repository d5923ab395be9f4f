"""Cache folders that cannot be used: not writable, not ours, open to others, full."""

from __future__ import annotations

import errno
import os
import resource
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mstmm.errors import EnvironmentFailure
from mstmm.runtime.libraries import cache
from tests.support.libraries.library_recipes import (
    NOBODY,
    Kernel,
    assert_tidy,
    library_value,
    without_privileges,
)


def refusal() -> str:
    with pytest.raises(EnvironmentFailure) as caught:
        cache.library(Kernel().recipe)
    message = str(caught.value)
    assert "\n" not in message and "MSTMM_CACHE" in message
    assert cache.find(Kernel().recipe) is None
    return message


def test_folder_of_another_user(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache_folder.mkdir(mode=0o700)
    if os.geteuid() == 0:
        os.chown(cache_folder, NOBODY, NOBODY)
    else:
        other = os.geteuid() + 1
        monkeypatch.setattr(os, "geteuid", lambda: other)
    assert "belongs to user" in refusal()
    assert not list(cache_folder.iterdir())


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702, 0o1777])
def test_folder_that_others_may_write_to(mode: int, cache_folder: Path) -> None:
    cache.library(Kernel().recipe)
    cache_folder.chmod(mode)
    assert f"{mode:04o}" in refusal()
    cache_folder.chmod(0o755)
    assert cache.library(Kernel().recipe).how == "cached"


def test_file_in_the_place_of_the_folder(cache_folder: Path) -> None:
    cache_folder.write_text("not a folder")
    assert "not a folder" in refusal()


@pytest.mark.parametrize("place", ["/proc/cache", "/dev/null/cache", "/proc/a/b/c"])
def test_folder_that_cannot_be_made(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MSTMM_CACHE", place)
    assert place in refusal()


def test_user_without_a_home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("MSTMM_CACHE")
    monkeypatch.setattr("platformdirs.user_cache_path", lambda name: Path("~/.cache") / name)
    monkeypatch.chdir(tmp_path)
    assert "no home folder" in refusal()
    assert not list(tmp_path.iterdir())


@pytest.fixture
def of_nobody(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache that belongs to whoever `without_privileges` is, where that user can reach it."""
    with tempfile.TemporaryDirectory(prefix="mstmm-test-", dir="/tmp") as outer:
        Path(outer).chmod(0o755)
        folder = Path(outer) / "cache"
        folder.mkdir(mode=0o700)
        if os.geteuid() == 0:
            os.chown(folder, NOBODY, NOBODY)
        monkeypatch.setenv("MSTMM_CACHE", str(folder))
        yield folder


def test_folder_that_can_only_be_read_still_serves(of_nobody: Path) -> None:
    kernel = Kernel()
    with without_privileges():
        first = cache.library(kernel.recipe)
        of_nobody.chmod(0o500)
        assert cache.library(kernel.recipe).how == "cached"
        assert library_value(first.path, first.key) == 21.0
        with pytest.raises(EnvironmentFailure, match=r"Permission denied.*MSTMM_CACHE"):
            cache.library(Kernel(factor=4).recipe)
        of_nobody.chmod(0o700)
        assert_tidy(of_nobody, 1)


# --- no room --------------------------------------------------------------------------------------


@pytest.mark.parametrize("limit", [0, 100, 3000, 8000])
def test_file_that_may_not_grow(
    limit: int, cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 0 not even the text can be written, later the compiler's own files cannot."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        message = refusal()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "no space" in message
    assert_tidy(cache_folder, 0)


@pytest.mark.parametrize("step", ["write_text", "mkdir", "write_bytes"])
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_disk_that_is_full(
    step: str, number: int, cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache.library(Kernel(factor=2).recipe)

    def full(path: Path, *arguments: Any, **more: Any) -> None:
        raise OSError(number, os.strerror(number), str(path))

    with monkeypatch.context() as patch:
        patch.setattr(Path, step, full)
        message = refusal()
    assert "no space" in message and os.strerror(number) in message
    assert_tidy(cache_folder, 1)
    assert cache.library(Kernel().recipe).how == "compiled"


def test_disk_that_is_full_before_anything(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache.library(Kernel(factor=2).recipe)

    def full(*arguments: Any, **more: Any) -> str:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(tempfile, "mkdtemp", full)
        assert "no space" in refusal()
    assert_tidy(cache_folder, 1)


def test_a_size_that_is_none_is_told_before_anything_is_compiled(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MSTMM_CACHE_SIZE", "abc")
    with pytest.raises(EnvironmentFailure, match="MSTMM_CACHE_SIZE='abc': expected the size"):
        cache.library(Kernel().recipe)
