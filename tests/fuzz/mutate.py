"""Changes of a scene: numbers, lists, strings and keys, from lawful-looking to absurd."""

from __future__ import annotations

import copy
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .seeds import Data, seeds

Place = tuple[str | int, ...]

EXTREME = (
    0, 0.0, -0.0, 1, -1, 2, 0.5, 1e-8, 1e-16, 1e-30, 1e-160, 5e-324, 1e14, 1e30, 1e154, 1.7e308,
    9e18, float("inf"), -float("inf"), float("nan"), 2**31, 2**63, 2**64, 10**400, True, False,
)  # fmt: skip
COUNTS = (0, 1, 2, 3, 5, 8, 13, 32, 60, 64, 100, 200, 384, 10**6, -1)
WORDS = (
    "", " ", "x", "ground", "free", "fixed", "ball", "pin", "spring", "static", "auto", "tangent",
    "chord", "30 deg", "1e3", "nan", "t", "q", "u", "root", "tip", "rod1.tip", "a" * 5000, "é",
    "\0", "\x1b[2J", "../x", "/dev/zero", "/", "one-way", "coupled", "rigid", "modal", "exact",
)  # fmt: skip
FUNCTIONS = "sin cos tan exp log sqrt abs sign tanh atan asin acos sinh cosh floor".split()
ATOMS = "t q u t^2 0 1 -1 0.5 1e3 1e-9 1e300 pi 3600 1/t 1/0 0^0 (t-0.02)".split()


@dataclass(frozen=True)
class Mutant:
    """A changed scene: which seed scene, its tables, and what was done to them."""

    origin: str
    data: Data
    changes: tuple[str, ...]


def mutant(seed: int, index: int, of: str = "") -> Mutant:
    """The mutant of this number: always the same.  `of`: of scenes with this in their names."""
    rng = random.Random(f"{seed}/{index}")
    origin = rng.choice([name for name in sorted(seeds()) if of in name])
    data = copy.deepcopy(seeds()[origin])
    done: list[str] = []
    for _ in range(rng.choice((1, 1, 1, 1, 2, 2, 3))):
        here = places(data)
        if rng.random() < 0.5:
            here = [place for place in here if _is_number(value_at(data, place))] or here
        if here:
            done.append(_change(data, rng.choice(here), rng))
    return Mutant(origin, data, tuple(done))


def places(data: Any, here: Place = ()) -> list[Place]:
    """Every place in nested tables and lists, inner nodes as well as leaves."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    found: list[Place] = []
    for key, value in items:
        found.append((*here, key))
        if isinstance(value, (dict, list)):
            found += places(value, (*here, key))
    return found


def value_at(data: Any, place: Place) -> Any:
    """Value at a place."""
    for part in place:
        data = data[part]
    return data


def _change(data: Data, place: Place, rng: random.Random) -> str:
    """One change at a place, in the data; what it was, in words."""
    inside, key = value_at(data, place[:-1]), place[-1]
    old = inside[key]
    roll = rng.random()
    if roll < 0.04:
        del inside[key]
        return f"{_path(place)} removed"
    if roll < 0.08 and isinstance(inside, dict):
        key, new = _other_key(rng)
    elif roll < 0.12:
        new = _from_elsewhere(rng)
    else:
        new = _mutate_value(old, rng)
    inside[key] = new
    return f"{_path((*place[:-1], key))}: {old!r:.80} -> {new!r:.80}"


def _path(place: Place) -> str:
    return ".".join(str(part) for part in place)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _mutate_value(old: Any, rng: random.Random) -> Any:
    if isinstance(old, bool):
        return rng.choice((not old, 0, 1, "true", None))
    if isinstance(old, (int, float)):
        return _number(old, rng)
    if isinstance(old, str):
        return _text(old, rng)
    if isinstance(old, list):
        return _list(old, rng)
    return rng.choice((None, 0, "", [], {}, [old], [old, old]))


def _number(old: float, rng: random.Random) -> Any:
    kinds: list[Callable[[], Any]] = [
        *[lambda: old * 10 ** rng.uniform(-2, 2)] * 6,
        lambda: -old,
        *[lambda: old * 10.0 ** rng.randint(-20, 20)] * 2,
        lambda: rng.choice((-1, 1)) * 10.0 ** rng.randint(-300, 300),
        lambda: rng.choice(EXTREME),
        lambda: rng.choice(EXTREME),
        lambda: rng.choice(COUNTS),
        lambda: rng.choice((None, "", str(old), f"{old} deg", [old], [old] * 3, {})),
        lambda: expression(rng),
    ]
    try:
        return rng.choice(kinds)()
    except OverflowError:
        return 10**400


def _text(old: str, rng: random.Random) -> Any:
    cut = rng.randint(0, len(old))
    kinds: list[Callable[[], Any]] = [
        lambda: rng.choice(WORDS),
        lambda: expression(rng),
        lambda: expression(rng),
        lambda: old[:cut] + rng.choice(("", " ", "x", "(", ".", "^", "0")) + old[cut + 1 :],
        lambda: old + rng.choice((" + t", "^2", "*1e300", ".tip", "2", "[0]", "/0")),
        lambda: rng.choice(strings(seeds()[rng.choice(sorted(seeds()))])),
        lambda: rng.choice((None, 0, 1.5, [old], [], {}, float("nan"))),
    ]
    return rng.choice(kinds)()


def _list(old: list[Any], rng: random.Random) -> Any:
    one = copy.deepcopy(rng.choice(old)) if old else 0
    kinds: list[Callable[[], Any]] = [
        list,
        lambda: old[1:],
        lambda: old[:-1],
        lambda: [*old, one],
        lambda: old[::-1],
        lambda: rng.sample(old, len(old)),
        lambda: [old],
        lambda: one,
        lambda: [one] * rng.choice((1, 2, 3, 4, 6, 7, 100)),
        lambda: [_mutate_value(x, rng) for x in old],
        lambda: [_mutate_value(x, rng) if rng.random() < 0.5 else x for x in old],
        lambda: [rng.choice(EXTREME) for _ in range(rng.choice((1, 2, 3, 3, 3, 6)))],
    ]
    return copy.deepcopy(rng.choice(kinds)())


def strings(data: Any) -> list[str]:
    """Every string of a scene."""
    inner = data.values() if isinstance(data, dict) else data
    found = [x for x in inner if isinstance(x, str)]
    for value in inner:
        if isinstance(value, (dict, list)):
            found += strings(value)
    return found or [""]


def _from_elsewhere(rng: random.Random) -> Any:
    """Something out of another scene."""
    other = seeds()[rng.choice(sorted(seeds()))]
    return copy.deepcopy(value_at(other, rng.choice(places(other))))


def _other_key(rng: random.Random) -> tuple[str, Any]:
    """A key of another scene with what stands there."""
    other = seeds()[rng.choice(sorted(seeds()))]
    named = [place for place in places(other) if isinstance(place[-1], str)]
    place = rng.choice(named)
    return str(place[-1]), copy.deepcopy(value_at(other, place))


def expression(rng: random.Random) -> str:
    """A text of the expressions' grammar, small or piled up."""
    if rng.random() < 0.1:
        return "^".join([rng.choice(("t", "q", "u", "2", "1.1"))] * rng.randint(2, 40))
    if rng.random() < 0.1:
        return rng.choice(FUNCTIONS) + "(" + expression(rng) + ")" * rng.randint(0, 2)
    text = rng.choice(ATOMS)
    for _ in range(rng.randint(0, 4)):
        other = rng.choice(ATOMS)
        text = rng.choice((
            f"({text} {rng.choice('+-*/^')} {other})", f"{rng.choice(FUNCTIONS)}({text})",
            f"where({text} < {other}, {other}, {rng.choice(ATOMS)})", f"min({text}, {other})",
            f"({other})^({text})", f"atan2({text}, {other})", f"-{text}",
        ))  # fmt: skip
    return text
