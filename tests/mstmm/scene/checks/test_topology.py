"""The tree of a scene, and what is not a tree."""

from __future__ import annotations

import random
from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Body, Hinge, Scene
from mstmm.scene.checks import topology
from tests.support.scenes.minimal import Data, body, hinge, is_chain


def scene_of(edges: dict[str, tuple[str, str]], order: list[str] | None = None) -> Data:
    """Bodies named in `order`; `edges` gives hinge name -> (inboard, outboard)."""
    names = order or sorted(
        {e.partition(".")[0] for pair in edges.values() for e in pair} - {"ground"}
    )
    return {
        "gravity": [0, 0, 0],
        "body": [body(n) for n in names],
        "hinge": [hinge(h, inboard=a, outboard=b) for h, (a, b) in edges.items()],
    }


def test_depth_first_branch_by_branch_in_scene_order() -> None:
    edges = {
        "h4": ("b.tip", "d"),
        "h1": ("ground", "b.tip"),
        "h5": ("ground", "e"),
        "h3": ("b", "a"),
        "h2": ("a.tip", "c"),
    }
    scene = Scene(**scene_of(edges, ["e", "c", "d", "b", "a"]))
    tree = topology.build_topology(scene)
    names = [scene.body[link.body].name for link in tree.links]
    assert names == ["e", "b", "d", "a", "c"]
    assert tree.parents == (-1, -1, 1, 1, 3)
    assert tree.roots == (0, 1)
    assert [link.children for link in tree.links] == [(), (2, 3), (), (4,), ()]
    assert [scene.hinge[link.hinge].name for link in tree.links] == ["h5", "h1", "h4", "h3", "h2"]
    assert [link.inboard_end for link in tree.links] == ["", "", "tip", "", "tip"]
    assert [link.outboard_end for link in tree.links] == ["", "tip", "", "", ""]
    assert all(tree.order[tree.position[i]] == i for i in range(5))
    assert not is_chain(tree)


def test_chain() -> None:
    tree = topology.build_topology(Scene(**scene_of({"h1": ("ground", "a"), "h2": ("a.tip", "b")})))
    assert tree.parents == (-1, 0)


def random_tree(n: int, seed: int) -> Data:
    rng = random.Random(seed)
    names = [f"b{i}" for i in range(n)]
    hinges: list[Any] = [
        hinge(
            f"h{i}",
            inboard=f"b{rng.randrange(max(0, i - 5), i)}" if i else "ground",
            outboard=f"b{i}",
        )
        for i in range(n)
    ]
    rng.shuffle(names)
    rng.shuffle(hinges)
    return {"gravity": [0, 0, 0], "body": [body(x) for x in names], "hinge": hinges}


@pytest.mark.parametrize("seed", range(5))
def test_random_trees_against_the_definition(seed: int) -> None:
    scene = Scene(**random_tree(60, seed))
    links = topology.build_topology(scene).links
    assert sorted(link.body for link in links) == list(range(60))
    for place, link in enumerate(links):
        joint = scene.hinge[link.hinge]
        assert joint.outboard_body == scene.body[link.body].name
        assert link.parent < place
        parent = "ground" if link.parent < 0 else scene.body[links[link.parent].body].name
        assert joint.inboard_body == parent
        bodies = [links[c].body for c in link.children]
        assert bodies == sorted(bodies)
        # Branch by branch: the first child follows at once, each subtree is contiguous.
        assert not link.children or link.children[0] == place + 1


NOT_TREES = [
    (
        {"h1": ("ground", "a"), "h2": ("a.tip", "b"), "h3": ("c", "b.tip")},
        ['body "c": it has no inboard hinge; swap inboard and outboard of hinge "h3"'],
    ),
    (
        {"h1": ("ground", "a"), "h2": ("c", "a.tip"), "h3": ("b", "c")},
        [
            'body "c": it has no inboard hinge; swap inboard and outboard of hinge "h2"',
            'body "b": it has no inboard hinge; swap inboard and outboard of hinge "h3"',
        ],
    ),
    (
        {"h1": ("ground", "a"), "h2": ("b", "c")},
        ['body "b": no hinge connects it (with c) to the ground', 'outboard = "b"', '"free"'],
    ),
    (
        {"h1": ("ground", "a"), "h2": ("c", "b")},
        ['body "b": no hinge connects it (with c) to the ground', 'outboard = "c"'],
    ),
    (
        {"h1": ("ground", "a"), "h2": ("b", "c"), "h3": ("c", "b")},
        ['body "b": no hinge connects it (with c)'],
    ),
]


@pytest.mark.parametrize(("edges", "fragments"), NOT_TREES)
def test_what_is_not_a_tree_is_named(
    edges: dict[str, tuple[str, str]], fragments: list[str]
) -> None:
    with pytest.raises(SceneError) as caught:
        Scene(**scene_of(edges))
    for fragment in fragments:
        assert fragment in str(caught.value)


def test_a_turned_hinge_becomes_a_tree_when_swapped_as_the_message_says() -> None:
    edges = {"h1": ("ground", "a"), "h2": ("c", "a.tip"), "h3": ("b", "c")}
    swapped = {"h1": ("ground", "a"), "h2": ("a.tip", "c"), "h3": ("c", "b")}
    with pytest.raises(SceneError):
        Scene(**scene_of(edges))
    assert is_chain(topology.build_topology(Scene(**scene_of(swapped))))


def test_no_hinge_at_all() -> None:
    with pytest.raises(SceneError) as caught:
        Scene(gravity=[0, 0, 0], body=[body("a"), body("b")])
    assert str(caught.value).count("no hinge connects it to the ground") == 2


def test_a_copy_that_lost_its_hinges_is_refused_too() -> None:
    scene = Scene(**scene_of({"h1": ("ground", "a"), "h2": ("a.tip", "b")}))
    with pytest.raises(SceneError, match=r'^scene: body "b": no hinge connects it'):
        topology.build_topology(scene.model_copy(update={"hinge": scene.hinge[:1]}))


def test_twenty_thousand_bodies_take_no_stack() -> None:
    n = 20_000  # put together without validation
    bodies = tuple(Body.model_construct(name=f"b{i}") for i in range(n))
    held = ("ground", *(f"b{i}.tip" for i in range(n)))
    hinges = tuple(
        Hinge.model_construct(name=f"h{i}", type="pin", inboard=held[i], outboard=f"b{i}")
        for i in range(n)
    )
    tree = topology.build_topology(
        Scene.model_construct(gravity=(0, 0, 0), body=bodies, hinge=hinges)
    )
    assert is_chain(tree) and len(tree.links) == n
