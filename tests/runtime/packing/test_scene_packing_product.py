"""The classical product of transfer matrices and the Riccati sweep on the same scenes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference import newton_euler as dense
from tests.reference.compare import fresh, worst
from tests.reference.jets import Array
from tests.reference.tree import read
from tests.support.classical.scene_product import SceneProduct, chain_bodies
from tests.support.models import compile_scene
from tests.support.scenes.rods import chain, drawn_state

KINDS = ("pin", "ball", "elastic")
TIME = 0.3


def drawn_chain(
    rng: np.random.Generator, kind: str, count: int
) -> tuple[dict[str, Any], Array, Array]:
    """Random chain of exactly `count` bodies of one hinge type, with loads, springs and laws."""
    while True:
        scene, q, u = fresh(rng, types=(kind,), chain=True, most=count)
        if len(scene["body"]) == count:
            for hinge in scene["hinge"]:
                hinge.get("law", {}).pop("inertia", None)
            return scene, q, u


# --- in doubles -------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("kind", [*KINDS, "free"])
def test_short_chains_agree_in_doubles(kind: str, count: int, rng: np.random.Generator) -> None:
    scene = chain([kind] * count, skew=0.4, inertia=(0.02, 0.09, 0.08), start=(0.3, -0.5, 0.8))
    product, riccati = compile_scene(scene, sweep="product", accuracy=1e-12), compile_scene(scene)
    for _ in range(5):
        q, u = drawn_state(scene, rng)
        assert worst(product.accelerations(q, u), riccati.accelerations(q, u)) < 1e-12
        assert worst(riccati.accelerations(q, u), dense.solve(scene, q, u).udot) < 1e-13


@pytest.mark.parametrize("kind", KINDS)
def test_product_with_laws_loads_and_skew_ends(kind: str, rng: np.random.Generator) -> None:
    """The engine's product has the same loads, laws and frames as its Riccati sweep."""
    for count in (1, 2, 3):
        scene, q, u = drawn_chain(rng, kind, count)
        product = compile_scene(scene, sweep="product", accuracy=1e-6)
        udot = product.accelerations(q, u, TIME)
        assert worst(udot, dense.solve(scene, q, u, TIME).udot) < 1e-6
        efforts = rng.uniform(-1, 1, len(u))
        expected = compile_scene(scene).accelerations(q, u, TIME, efforts)
        assert worst(product.accelerations(q, u, TIME, efforts), expected) < 1e-6


# --- at 50 digits -----------------------------------------------------------------------------


def deviation(scene: dict[str, Any], q: Array, u: Array) -> float:
    """Accelerations of the input ends: product at 50 digits against the Riccati sweep."""
    expected = SceneProduct(scene, q, u, TIME).accelerations()
    result = compile_scene(scene).simulate(TIME, t_start=TIME, initial=(q, u))
    found = [
        np.concatenate([result.acceleration(end)[0], result.angular_acceleration(end)[0]])
        for end in chain_bodies(read(scene))
    ]
    return worst(found, expected)


@pytest.mark.parametrize("count", [2, 5, 8])
@pytest.mark.parametrize("kind", KINDS)
def test_product_at_fifty_digits_is_the_riccati_sweep(
    kind: str, count: int, rng: np.random.Generator
) -> None:
    scene = chain([kind] * count, skew=0.4, inertia=(0.02, 0.09, 0.08), start=(0.3, -0.5, 0.8))
    assert deviation(scene, *drawn_state(scene, rng)) < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_product_at_fifty_digits_with_laws_loads_and_skew_ends(
    kind: str, rng: np.random.Generator
) -> None:
    scene, q, u = drawn_chain(rng, kind, 4)
    assert deviation(scene, q, u) < 1e-11


# --- motions ----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_motions_agree(kind: str) -> None:
    scene = chain([kind] * 3, skew=0.4, inertia=(0.05, 0.09, 0.08))
    for hinge in scene["hinge"]:
        entries = {"elastic": 6, "ball": 3}.get(kind, 1)
        hinge["law"] = {"stiffness": [40.0] * entries, "damping": [0.5] * entries}
    q, u = drawn_state(scene, np.random.default_rng(8))
    times = np.linspace(0, 1, 6)
    options: dict[str, Any] = {"rtol": 1e-10, "output_times": times, "initial": (q, u)}
    product = compile_scene(scene, sweep="product").simulate(1.0, **options)
    riccati = compile_scene(scene).simulate(1.0, **options)
    assert product.success, product.message
    assert np.abs(product.q - riccati.q).max() < 1e-9
    assert np.abs(product.u - riccati.u).max() < 1e-8


@pytest.mark.parametrize("sweep", ["riccati", "product"])
def test_threads_share_a_model(sweep: str, rng: np.random.Generator) -> None:
    scene = chain(["pin"] * 3, skew=0.4, inertia=(0.02, 0.09, 0.08))
    model = compile_scene(scene, sweep=sweep, accuracy=1e-6)
    states = rng.uniform(-1, 1, (2, 2, 5000, 3))
    expected = [model.accelerations(q, u) for q, u in states]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda state: model.accelerations(*state), states))
    assert np.array_equal(found, expected)


# --- what it refuses --------------------------------------------------------------------------


def test_accuracy_asked_for_is_kept_or_named() -> None:
    scene = chain(["pin"] * 16)
    q, u = drawn_state(scene, np.random.default_rng(3))
    gap = worst(
        compile_scene(scene, sweep="product", accuracy=1.0).accelerations(q, u),
        compile_scene(scene).accelerations(q, u),
    )
    assert 1e-12 < gap < 1e-2
    compile_scene(scene, sweep="product", accuracy=2 * gap).accelerations(q, u)
    with pytest.raises(mstmm.NumericalFailure, match=r"deviation.*accuracy.*riccati"):
        compile_scene(scene, sweep="product", accuracy=gap / 2).accelerations(q, u)


@pytest.mark.parametrize(
    ("kinds", "named"),
    [
        (("pin", "ball"), 'hinge "hinge1".*ball outboard of type pin'),
        (("ball", "pin"), 'hinge "hinge1".*pin outboard of type ball'),
        (("elastic", "ball"), 'hinge "hinge1".*ball outboard of type elastic'),
        (("pin", "cylindrical"), 'hinge "hinge1".*cylindrical'),
        (("prismatic", "prismatic"), 'hinge "hinge0".*prismatic'),
        (("pin", "fixed", "pin"), 'hinge "hinge1".*fixed'),
    ],
)
def test_pairs_without_a_matrix_are_named(kinds: tuple[str, ...], named: str) -> None:
    with pytest.raises(mstmm.SceneError, match=named + ".*riccati"):
        compile_scene(chain(kinds), sweep="product")


def _branch_chain(scene: dict[str, Any]) -> None:
    scene["hinge"][2]["inboard"] = "rod0.tip"


def _two_roots(scene: dict[str, Any]) -> None:
    scene["hinge"][2]["inboard"] = "ground"


def _drive_hinge(scene: dict[str, Any]) -> None:
    scene["hinge"][1]["drive"] = "sin(t)"


def _rotor(scene: dict[str, Any]) -> None:
    scene["hinge"][1]["law"] = {"inertia": 0.1}


def _remove_mass(scene: dict[str, Any]) -> None:
    scene["body"][1] = {"name": "rod1", "mass": 0.0, "ends": scene["body"][1]["ends"]}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        pytest.param(_branch_chain, "unbranched chain", id="_branched-unbranched chain"),
        (_two_roots, "unbranched chain"),
        pytest.param(_drive_hinge, 'hinge "hinge1".*drives', id='_driven-hinge "hinge1".*drives'),
        (_rotor, 'hinge "hinge1".*rotor'),
        pytest.param(_remove_mass, 'body "rod1".*mass', id='_massless-body "rod1".*mass'),
    ],
)
def test_scenes_without_a_matrix_are_named(change: Any, named: str) -> None:
    scene = chain(["pin"] * 3)
    change(scene)
    with pytest.raises(mstmm.SceneError, match=named + ".*riccati"):
        compile_scene(scene, sweep="product")


def test_an_unknown_sweep_is_named() -> None:
    there_are = 'sweep "plain" is not known; there are: auto, riccati, refined, qr, product'
    with pytest.raises(mstmm.SceneError, match=there_are):
        compile_scene(chain(["pin"]), sweep="plain")


@pytest.mark.parametrize("accuracy", [0.0, -1e-6, float("nan")])
def test_an_accuracy_that_nothing_has_is_refused(accuracy: float) -> None:
    with pytest.raises(mstmm.SceneError, match=r"accuracy = .*positive"):
        compile_scene(chain(["pin"]), sweep="product", accuracy=accuracy)
