"""What all tests share: a printed seed, hypothesis settings, pictures without a screen."""

from __future__ import annotations

import gc
import importlib.util
import os
import signal
import tempfile
from collections import Counter
from collections.abc import Iterator

# Tests run side by side, one a core: threads of linear algebra would only wait for each other.
# numpy reads this when it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import HealthCheck, is_hypothesis_test, settings

os.environ.setdefault("MPLBACKEND", "Agg")

# Libraries that the tests compile: nothing of the user's cache is read or changed.
CACHE = tempfile.TemporaryDirectory(prefix="mstmm-cache-")
os.environ.setdefault("MSTMM_CACHE", CACHE.name)


# What tests draw; printed at the head of a run.  The same for everybody, so that what passed passes
# again; MSTMM_TEST_SEED=<number> draws other data (CONTRIBUTING.md, "Tests").
SEED = int(os.environ.get("MSTMM_TEST_SEED", "1"))

settings.register_profile(
    "mstmm", deadline=None, max_examples=30, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("mstmm")

# The comparisons with other programs need those programs, which live in an environment of their
# own (CONTRIBUTING.md, "Tests"); there `pytest tests/peers` runs them.
collect_ignore = [] if importlib.util.find_spec("pinocchio") else ["peers"]


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Hypothesis draws by the same seed, unless it is given one of its own; pytest-xdist hands out
    files in the order of `pytest_collection_modifyitems`, not by their numbers of tests."""
    if config.getoption("--hypothesis-seed") is None:
        config.option.hypothesis_seed = SEED
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests that draw their data.  Puts files with most slow tests first, then those with
    most tests, so that no core waits for a long file at the end."""
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    tests = Counter(item.path for item in items)
    items.sort(key=lambda item: (-slow[item.path], -tests[item.path], item.path))
    for item in items:
        if isinstance(item, pytest.Function) and (
            "rng" in item.fixturenames or is_hypothesis_test(item.obj)
        ):
            item.add_marker(pytest.mark.drawn)


def pytest_collection_finish() -> None:
    """Exclude imported objects, which are never freed, from garbage collection."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_unconfigure() -> None:
    CACHE.cleanup()


def pytest_report_header() -> str:
    """The line that lets a failure on drawn data be repeated."""
    return f"MSTMM_TEST_SEED={SEED}"


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Random numbers that depend on the run's seed and on the test's own name alone."""
    return np.random.default_rng([SEED, *request.node.name.encode()])


@pytest.fixture
def heard() -> Iterator[None]:
    """Ctrl-C and SIGTERM arrive, here and in processes started meanwhile, also where the tests run
    with signals ignored, as under nohup."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)
