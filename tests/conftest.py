"""What all tests share: a printed seed, hypothesis settings, pictures without a screen."""

from __future__ import annotations

import importlib.util
import os
import secrets
import signal
import tempfile
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("MPLBACKEND", "Agg")

# Libraries that the tests compile: nothing of the user's cache is read or changed.
CACHE = tempfile.TemporaryDirectory(prefix="mstmm-cache-")
os.environ.setdefault("MSTMM_CACHE", CACHE.name)

# Drawn afresh for each run and printed at its head; MSTMM_TEST_SEED=<it> repeats the run.
SEED = int(os.environ.get("MSTMM_TEST_SEED") or secrets.randbelow(2**32))

settings.register_profile(
    "mstmm", deadline=None, max_examples=30, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("mstmm")

# The comparisons with other programs need those programs, which live in an environment of their
# own (CONTRIBUTING.md, "Tests"); there `pytest tests/peers` runs them.
collect_ignore = [] if importlib.util.find_spec("pinocchio") else ["peers"]


def pytest_unconfigure() -> None:
    CACHE.cleanup()


def pytest_report_header() -> str:
    """The line that lets a failure on drawn data be repeated."""
    return f"MSTMM_TEST_SEED={SEED}"


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Random numbers that depend on the run's seed and on the test's own name alone."""
    return np.random.default_rng([SEED, *request.node.nodeid.encode()])


@pytest.fixture
def heard() -> Iterator[None]:
    """Ctrl-C and SIGTERM arrive, here and in processes started meanwhile, also where the tests run
    with signals ignored, as under nohup."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)
