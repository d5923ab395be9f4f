"""Checks of the keys of a beam against each other: sections, shapes, ends, initial values."""

from __future__ import annotations

from collections.abc import Iterator

from ..validators.scalars_and_vectors import Location, count_text, describe_value
from ..validators.validation_messages import did_you_mean
from .beam_keys import DIRECTIONS, MAX_SHAPES, BeamKeys, Section
from .shape_functions import shape_problem

Problem = tuple[Location, str]

#: Largest gap between pieces, and distance of ends from the beam, relative to its length.
_MAX_RELATIVE_ROUNDING = 1e-9
#: Largest relative difference of the polar inertia from the sum of both rotary inertias.
_MAX_POLAR_DIFFERENCE = 1e-3
#: Smallest mass, moment and stiffness of a beam, and the inverse of the largest.
_MIN_MAGNITUDE = 1e-100
#: Largest ratio between two pieces of a beam in mass or stiffness per length.
_MAX_PIECE_RATIO = 1e12

#: Key of the section -> its meaning and unit.
_KEY_DESCRIPTIONS = {
    "mass_per_length": "a number in kg/m, more than 0",
    "bending_stiffness": "E I in N m^2, more than 0: a number, or [about y, about z]",
    "axial_stiffness": "E A in N, more than 0",
    "torsional_stiffness": "G I_t in N m^2, more than 0",
    "polar_inertia_per_length": "rho I_p in kg m, more than 0",
    "rotary_inertia": "[rho I_y, rho I_z] in kg m, more than 0",
}


def problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of the keys of a beam with each other."""
    section_problems = list(_section_problems(beam))
    yield from section_problems
    yield from _mode_problems(beam)
    if not section_problems:
        yield from _property_problems(beam)
        yield from _polar_inertia_problems(beam)
        yield from _magnitude_problems(beam)
    yield from _shape_problems(beam)
    yield from _end_problems(beam)
    yield from _list_problems(beam)


def joined_sections(beam: BeamKeys) -> tuple[Section, ...]:
    """Pieces of a beam, each starting exactly where the one before ends."""
    joined_pieces: list[Section] = []
    for k, piece in enumerate(beam.section):
        start = joined_pieces[-1].to if joined_pieces else 0.0
        end = beam.length if k == len(beam.section) - 1 else piece.to
        joined_pieces.append(piece.model_copy(update={"from_": start, "to": end}))
    return tuple(joined_pieces)


def _section_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of pieces that do not cover the beam exactly once from root to tip."""
    covered_length, tolerance = 0.0, _MAX_RELATIVE_ROUNDING * beam.length
    for i, piece in enumerate(beam.section):
        if piece.to - piece.from_ <= tolerance:
            yield (
                ("section", i, "to"),
                f"expected a number in m, more than from ({piece.from_:g}), found {piece.to:g}",
            )
            return
        if abs(piece.from_ - covered_length) > tolerance:
            defect = "gap" if piece.from_ > covered_length else "overlap"
            boundary_text = "the beam begins" if i == 0 else "the previous piece ends"
            yield (
                ("section", i, "from"),
                f"expected {covered_length:g} m, where {boundary_text}, found {piece.from_:g}, "
                f"{_with_article(defect)} of {abs(piece.from_ - covered_length):g} m; write from "
                f"= {covered_length:g}",
            )
            return
        covered_length = piece.to
    if beam.section and abs(covered_length - beam.length) > tolerance:
        yield (
            ("section", len(beam.section) - 1, "to"),
            f"expected the length of the beam, {beam.length:g} m, found {covered_length:g}; "
            "correct the end of the last piece, or length",
        )


def _with_article(word: str) -> str:
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"


# --- shapes and their required properties ---------------------------------------------------------


def _mode_problems(beam: BeamKeys) -> Iterator[Problem]:
    if beam.modes is None or beam.model == "rigid":
        return
    if beam.modes.total == 0:
        yield (
            ("modes",),
            "expected at least one shape, found none; write for example modes = 3, or "
            'model = "rigid"',
        )
    for direction, count in zip(DIRECTIONS, beam.modes.counts, strict=True):
        if count > MAX_SHAPES:
            yield (
                ("modes", direction),
                f"expected {MAX_SHAPES} shapes or fewer, found {count}: shapes with such short "
                "waves are linearly dependent to rounding and outside beam theory; "
                "divide the beam into parts on fixed hinges",
            )


def _property_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of missing section properties, or of properties given only for some pieces."""
    sections = beam.sections
    for key, reason in _required_keys(beam).items():
        for i, piece in enumerate(sections):
            if getattr(piece, key) is None:
                yield (
                    _location_of(beam, i, key),
                    f"missing; {reason}expected {_KEY_DESCRIPTIONS[key]}",
                )
                break
    for key in _KEY_DESCRIPTIONS:
        incomplete_indices = [i for i, piece in enumerate(sections) if getattr(piece, key) is None]
        if 0 < len(incomplete_indices) < len(sections) and key not in _required_keys(beam):
            yield (
                _location_of(beam, incomplete_indices[0], key),
                f"missing, though other pieces have it; expected {_KEY_DESCRIPTIONS[key]}",
            )


def _location_of(beam: BeamKeys, i: int, key: str) -> Location:
    return ("section", i, key) if beam.section else (key,)


def _required_keys(beam: BeamKeys) -> dict[str, str]:
    """Required keys, each with the reason as a prefix for messages."""
    required = {"mass_per_length": ""}
    if beam.model == "rigid":
        return required
    modes = beam.modes
    if modes is None or modes.y or modes.z:
        required["bending_stiffness"] = ""
    if modes is not None and modes.twist:
        required["torsional_stiffness"] = "twist shapes need it: "
        required["polar_inertia_per_length"] = "twist shapes need it: "
    if modes is not None and modes.axial:
        required["axial_stiffness"] = "axial shapes need it: "
    return required


def _polar_inertia_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of a polar inertia that is not the sum of both rotary inertias."""
    for i, piece in enumerate(beam.sections):
        polar, rotary = piece.polar_inertia_per_length, piece.rotary_inertia
        if (
            polar is None
            or rotary is None
            or abs(polar - sum(rotary)) <= _MAX_POLAR_DIFFERENCE * polar
        ):
            continue
        yield (
            _location_of(beam, i, "polar_inertia_per_length"),
            f"expected the sum of both entries of rotary_inertia, {sum(rotary):g} kg m, as for "
            f"every plane section, found {polar:g}; leave it out",
        )
        return


def _magnitude_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of a beam whose moments, stiffnesses or frequencies overflow or underflow."""
    if any(piece.mass_per_length is None for piece in beam.sections):
        return
    length_squared, length_cubed = (
        beam.length * beam.length,
        beam.length * beam.length * beam.length,
    )
    sizes = [length_cubed, beam.mass, beam.mass * length_squared]
    for piece in beam.sections:
        stiffness = [EI / (length_cubed or 1) for EI in piece.bending_stiffness or ()]
        stiffness += [EA / beam.length for EA in (piece.axial_stiffness,) if EA is not None]
        sizes += [*stiffness, *(k / (beam.mass or 1) for k in stiffness)]
        polar_inertia = piece.polar_inertia_per_length
        for twist in (piece.torsional_stiffness,) if polar_inertia else ():
            sizes += (
                []
                if twist is None
                else [twist, twist / (polar_inertia or 1) / (length_squared or 1)]
            )
    if not all(_MIN_MAGNITUDE < size < 1 / _MIN_MAGNITUDE for size in sizes):
        yield (
            ("length",),
            f"a beam of {beam.length:g} m and {beam.mass:g} kg has mass and stiffness outside the "
            "range of double precision; check the units (m, kg/m, N m^2)",
        )
        return
    yield from _ratio_problems(beam)


def _ratio_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of pieces so different that shapes of one are lost to rounding of another."""
    for key in _KEY_DESCRIPTIONS:
        section_values = [getattr(piece, key) for piece in beam.sections]
        rows = [
            entry if isinstance(entry, tuple) else (entry,)
            for entry in section_values
            if entry is not None
        ]
        for column in zip(*rows, strict=True):
            smallest, largest = min(column), max(column)
            if smallest > 0 and largest > _MAX_PIECE_RATIO * smallest:
                i = next(i for i, row in enumerate(rows) if smallest in row)
                yield (
                    _location_of(beam, i, key),
                    f"expected {1 / _MAX_PIECE_RATIO:g} of the largest one, {largest:g}, or more, "
                    f"found "
                    f"{smallest:g}: the shapes of such a beam are linearly dependent to rounding; "
                    "model the light part as a separate beam",
                )
                return


def _shape_problems(beam: BeamKeys) -> Iterator[Problem]:
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
            f"{word_} = {shape_count}"
            for word_, shape_count in zip(DIRECTIONS, shapes.modes.counts, strict=True)
        )
        yield ("modes",), f"shapes has {counts}; leave out modes"
    for direction in DIRECTIONS:
        for i, expression in enumerate(getattr(shapes, direction)):
            message = shape_problem(expression, beam.length, 2 if direction in ("y", "z") else 1)
            if message is not None:
                yield ("shapes", direction, i), message


# --- ends, frame, start values --------------------------------------------------------------------


def _end_problems(beam: BeamKeys) -> Iterator[Problem]:
    tolerance = _MAX_RELATIVE_ROUNDING * beam.length
    for name, end in beam.ends.items():
        x, y, z = end.position
        location: Location = ("ends", name)
        fixed_position = {"root": 0.0, "tip": beam.length}.get(name)
        if y or z:
            yield (
                location,
                f"expected a point on the axis of the beam, found {describe_value(end.position)}; "
                "connect an offset end by a rigid body on a fixed hinge",
            )
        elif fixed_position is not None and abs(x - fixed_position) > tolerance:
            yield (
                location,
                f'expected {fixed_position:g} m, the position of "{name}" on every beam, found '
                f"{x:g}; choose another name",
            )
        elif not -tolerance <= x <= beam.length + tolerance:
            yield (
                location,
                f"expected a position on the beam, 0 to {beam.length:g} m, found {x:g}",
            )
    frame_end = beam.frame_end
    if frame_end and frame_end not in beam.ends:
        yield (
            ("frame",),
            f'there is no end "{frame_end}"{did_you_mean(frame_end, beam.ends)}; define a section '
            f"as an end, as in ends = {{ {frame_end} = {beam.length / 2:g} }}",
        )


def _list_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of lists that need one entry per shape."""
    lists = [
        (("initial", "eta"), beam.initial.eta),
        (("initial", "etad"), beam.initial.etad),
        (("damping", "ratio"), beam.damping.ratio if len(beam.damping.ratio) != 1 else None),
    ]
    for location, values in lists:
        if values is None:
            continue
        names = beam.mode_names
        if beam.modes is None:
            yield location, 'modes = "auto" chooses the number of shapes; give modes as numbers'
        elif names is not None and len(values) != len(names):
            yield (
                location,
                f"expected {count_text(len(names))}, one per shape: {_names_text(names)}, "
                f"found {len(values)}",
            )


def _names_text(names: tuple[str, ...]) -> str:
    shown_names = ", ".join(names[:8])
    return f"{shown_names}, ..., {names[-1]}" if len(names) > 8 else shown_names or "none"
