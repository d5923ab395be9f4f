"""Checks of the keys of a beam against each other: sections, shapes, ends, initial values."""

from __future__ import annotations

from collections.abc import Iterator

from ..rules.messages import near
from ..rules.values import Location, counted, found
from .beam_keys import DIRECTIONS, MAX_SHAPES, BeamKeys, Section
from .shapes import problem_with

Problem = tuple[Location, str]

#: Largest gap between pieces, and distance of ends from the beam, relative to its length.
_ROUNDING = 1e-9
#: Largest relative difference of the polar inertia from the sum of both rotary inertias.
_AGREES = 1e-3
#: Smallest mass, moment and stiffness of a beam, and the inverse of the largest.
_TINY = 1e-100
#: Largest ratio between two pieces of a beam in mass or stiffness per length.
_CONTRAST = 1e12

#: Key of the section -> its meaning and unit.
_MEANING = {
    "mass_per_length": "a number in kg/m, more than 0",
    "bending_stiffness": "E I in N m^2, more than 0: a number, or [about y, about z]",
    "axial_stiffness": "E A in N, more than 0",
    "torsional_stiffness": "G I_t in N m^2, more than 0",
    "polar_inertia_per_length": "rho I_p in kg m, more than 0",
    "rotary_inertia": "[rho I_y, rho I_z] in kg m, more than 0",
}


def problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of the keys of a beam with each other."""
    pieces = list(_pieces(beam))
    yield from pieces
    yield from _modes(beam)
    if not pieces:
        yield from _data(beam)
        yield from _polar(beam)
        yield from _sizes(beam)
    yield from _shapes(beam)
    yield from _ends(beam)
    yield from _lists(beam)


def joined(beam: BeamKeys) -> tuple[Section, ...]:
    """Pieces of a beam, each starting exactly where the one before ends."""
    pieces: list[Section] = []
    for k, piece in enumerate(beam.section):
        start = pieces[-1].to if pieces else 0.0
        end = beam.length if k == len(beam.section) - 1 else piece.to
        pieces.append(piece.model_copy(update={"from_": start, "to": end}))
    return tuple(pieces)


def _pieces(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of pieces that do not cover the beam exactly once from root to tip."""
    reached, slack = 0.0, _ROUNDING * beam.length
    for i, piece in enumerate(beam.section):
        if piece.to - piece.from_ <= slack:
            yield (
                ("section", i, "to"),
                f"expected a number in m, more than from ({piece.from_:g}), found {piece.to:g}",
            )
            return
        if abs(piece.from_ - reached) > slack:
            what = "gap" if piece.from_ > reached else "overlap"
            before = "the beam begins" if i == 0 else "the previous piece ends"
            yield (
                ("section", i, "from"),
                f"expected {reached:g} m, where {before}, found {piece.from_:g}, "
                f"{_article(what)} of {abs(piece.from_ - reached):g} m; write from = {reached:g}",
            )
            return
        reached = piece.to
    if beam.section and abs(reached - beam.length) > slack:
        yield (
            ("section", len(beam.section) - 1, "to"),
            f"expected the length of the beam, {beam.length:g} m, found {reached:g}; correct the "
            "end of the last piece, or length",
        )


def _article(word: str) -> str:
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"


# --- shapes and their required properties ---------------------------------------------------------


def _modes(beam: BeamKeys) -> Iterator[Problem]:
    if beam.modes is None or beam.model == "rigid":
        return
    if beam.modes.total == 0:
        yield (
            ("modes",),
            "expected at least one shape, found none; write for example modes = 3, or "
            'model = "rigid"',
        )
    for word, count in zip(DIRECTIONS, beam.modes.counts, strict=True):
        if count > MAX_SHAPES:
            yield (
                ("modes", word),
                f"expected {MAX_SHAPES} shapes or fewer, found {count}: shapes with such short "
                "waves are linearly dependent to rounding and outside beam theory; "
                "divide the beam into parts on fixed hinges",
            )


def _data(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of missing section properties, or of properties given only for some pieces."""
    given = beam.sections
    for key, why in _needed(beam).items():
        for i, piece in enumerate(given):
            if getattr(piece, key) is None:
                yield _at(beam, i, key), f"missing; {why}expected {_MEANING[key]}"
                break
    for key in _MEANING:
        lacking = [i for i, piece in enumerate(given) if getattr(piece, key) is None]
        if 0 < len(lacking) < len(given) and key not in _needed(beam):
            yield (
                _at(beam, lacking[0], key),
                f"missing, though other pieces have it; expected {_MEANING[key]}",
            )


def _at(beam: BeamKeys, i: int, key: str) -> Location:
    return ("section", i, key) if beam.section else (key,)


def _needed(beam: BeamKeys) -> dict[str, str]:
    """Required keys, each with the reason as a prefix for messages."""
    needed = {"mass_per_length": ""}
    if beam.model == "rigid":
        return needed
    modes = beam.modes
    if modes is None or modes.y or modes.z:
        needed["bending_stiffness"] = ""
    if modes is not None and modes.twist:
        needed["torsional_stiffness"] = "twist shapes need it: "
        needed["polar_inertia_per_length"] = "twist shapes need it: "
    if modes is not None and modes.axial:
        needed["axial_stiffness"] = "axial shapes need it: "
    return needed


def _polar(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of a polar inertia that is not the sum of both rotary inertias."""
    for i, piece in enumerate(beam.sections):
        polar, rotary = piece.polar_inertia_per_length, piece.rotary_inertia
        if polar is None or rotary is None or abs(polar - sum(rotary)) <= _AGREES * polar:
            continue
        yield (
            _at(beam, i, "polar_inertia_per_length"),
            f"expected the sum of both entries of rotary_inertia, {sum(rotary):g} kg m, as for "
            f"every plane section, found {polar:g}; leave it out",
        )
        return


def _sizes(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of a beam whose moments, stiffnesses or frequencies overflow or underflow."""
    if any(piece.mass_per_length is None for piece in beam.sections):
        return
    square, cube = beam.length * beam.length, beam.length * beam.length * beam.length
    sizes = [cube, beam.mass, beam.mass * square]
    for piece in beam.sections:
        stiffness = [EI / (cube or 1) for EI in piece.bending_stiffness or ()]
        stiffness += [EA / beam.length for EA in (piece.axial_stiffness,) if EA is not None]
        sizes += [*stiffness, *(k / (beam.mass or 1) for k in stiffness)]
        turning = piece.polar_inertia_per_length
        for twist in (piece.torsional_stiffness,) if turning else ():
            sizes += [] if twist is None else [twist, twist / (turning or 1) / (square or 1)]
    if not all(_TINY < size < 1 / _TINY for size in sizes):
        yield (
            ("length",),
            f"a beam of {beam.length:g} m and {beam.mass:g} kg has mass and stiffness outside the "
            "range of double precision; check the units (m, kg/m, N m^2)",
        )
        return
    yield from _contrast(beam)


def _contrast(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of pieces so different that shapes of one are lost to rounding of another."""
    for key in _MEANING:
        given = [getattr(piece, key) for piece in beam.sections]
        rows = [one if isinstance(one, tuple) else (one,) for one in given if one is not None]
        for column in zip(*rows, strict=True):
            least, most = min(column), max(column)
            if least > 0 and most > _CONTRAST * least:
                i = next(i for i, row in enumerate(rows) if least in row)
                yield (
                    _at(beam, i, key),
                    f"expected {1 / _CONTRAST:g} of the largest one, {most:g}, or more, found "
                    f"{least:g}: the shapes of such a beam are linearly dependent to rounding; "
                    "model the light part as a separate beam",
                )
                return


def _shapes(beam: BeamKeys) -> Iterator[Problem]:
    shapes = beam.shapes
    if shapes is None:
        if beam.basis == "given":
            yield ("shapes",), 'missing; basis = "given" needs shapes, as in { y = ["(x/L)^2"] }'
        return
    if beam.basis != "given":
        yield (
            ("basis",),
            f'expected "given" with shapes, found "{beam.basis}"; leave out basis or shapes',
        )
    if beam.modes is not None and beam.modes != shapes.modes:
        counts = ", ".join(
            f"{w} = {n}" for w, n in zip(DIRECTIONS, shapes.modes.counts, strict=True)
        )
        yield ("modes",), f"shapes has {counts}; leave out modes"
    for word in DIRECTIONS:
        for i, expression in enumerate(getattr(shapes, word)):
            message = problem_with(expression, beam.length, 2 if word in ("y", "z") else 1)
            if message is not None:
                yield ("shapes", word, i), message


# --- ends, frame, start values --------------------------------------------------------------------


def _ends(beam: BeamKeys) -> Iterator[Problem]:
    slack = _ROUNDING * beam.length
    for name, end in beam.ends.items():
        x, y, z = end.position
        place: Location = ("ends", name)
        fixed = {"root": 0.0, "tip": beam.length}.get(name)
        if y or z:
            yield (
                place,
                f"expected a point on the axis of the beam, found {found(end.position)}; connect "
                "an offset end by a rigid body on a fixed hinge",
            )
        elif fixed is not None and abs(x - fixed) > slack:
            yield (
                place,
                f'expected {fixed:g} m, the position of "{name}" on every beam, found {x:g}; '
                "choose another name",
            )
        elif not -slack <= x <= beam.length + slack:
            yield (
                place,
                f"expected a position on the beam, 0 to {beam.length:g} m, found {x:g}",
            )
    at = beam.frame_end
    if at and at not in beam.ends:
        yield (
            ("frame",),
            f'there is no end "{at}"{near(at, beam.ends)}; define a section as an end, as in '
            f"ends = {{ {at} = {beam.length / 2:g} }}",
        )


def _lists(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of lists that need one entry per shape."""
    lists = [
        (("initial", "eta"), beam.initial.eta),
        (("initial", "etad"), beam.initial.etad),
        (("damping", "ratio"), beam.damping.ratio if len(beam.damping.ratio) != 1 else None),
    ]
    for place, values in lists:
        if values is None:
            continue
        names = beam.mode_names
        if beam.modes is None:
            yield place, 'modes = "auto" chooses the number of shapes; give modes as numbers'
        elif names is not None and len(values) != len(names):
            yield (
                place,
                f"expected {counted(len(names))}, one per shape: {_named(names)}, "
                f"found {len(values)}",
            )


def _named(names: tuple[str, ...]) -> str:
    shown = ", ".join(names[:8])
    return f"{shown}, ..., {names[-1]}" if len(names) > 8 else shown or "none"
