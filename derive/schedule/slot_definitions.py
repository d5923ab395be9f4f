"""Definitions of slots and traits of the schedule.

A slot is "owner.name".  `parent`, `on`, `axes`, `from` and `to` are bodies by their role, `modes`
is the flexible body that a section belongs to; `local` slots exist for one subject of one pass. "[4
7]" after a slot selects entries, "[k]" the entry of the current speed.  Sizes: numbers, nu and free
(all and free speeds of the hinge), n (modes), nq.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Constants that any port may read, with the length of the port.
CONSTANTS = {
    "identity": "identity rotation", "zero": "zeros", "none": "empty",
    "plane": "free and constrained directions of a pin about z, row by row",
}  # fmt: skip

#: Owners that denote a body by its role.
ROLES = ("parent", "on", "axes", "from", "to", "outboard", "meeting")


@dataclass(frozen=True)
class Slot:
    """A slot and its meaning; `size` is a product of numbers and names."""

    name: str
    size: str
    meaning: str


_BODY = """
R | 9 | rotation, body axes to parent axes
r | 3 | P of the body from P of the parent, parent axes
motion | 9 | bias motion w, wd, rdd of P, own axes
S | 21 | f = S a + e of everything outboard, at P
e | 6 | force part of f = S a + e, at P
delta | 6 | deviation of the acceleration from the bias motion
A | 9 | axes, body to inertial
x | 3 | P, inertial axes
v | 3 | velocity of P, own axes
floor | 2 | least inertia along and about an axis above rounding
s | nu | prescribed part of the accelerations
tau | nu | efforts on the speeds
bias_offset | nu | accelerations that cancel the bias motion along free directions
own | 21 | S of the body alone
U | 21 | rows of everything outboard, S = U^T U: the upper triangle
d | 6 | load part of the rows, f = U^T (U a + d) + e
w | 3 | angular velocity, own axes: the first of `motion`
p | np | parameters of the body's kernels
q | nq | coordinates of the hinge
u | nu | speeds of the hinge
rotor | nu | inertia of rotors reflected to the speeds
given | nu | given accelerations of inverse dynamics
efforts | nu | efforts of the caller
qdot | nq | rates of the coordinates
udot | nu | accelerations
required | nu | efforts required by the given accelerations
column | nu | right-hand side of a solution
answer | nu | accelerations, the solution
"""
_HINGE = """
R | 9 | rotation across the hinge, outboard to inboard hinge axes
d | 3 | P from Q, inboard hinge axes
H | 6 nu | motion subspace
v | 3 | relative velocity, outboard axes
w | 3 | relative angular velocity, outboard axes
c | 6 | relative acceleration at udot = 0
p | np | parameters of the hinge's kernels
G | 6 nu | udot = g - G a
g | nu | udot = g - G a
rates | nu | accelerations of the free speeds
H_free | 6 free | columns of H of the free speeds
J_free | free | rotor inertia of the free speeds
tau_free | free | efforts on the free speeds
F | free free | D = L diag(d) L^T: L, and 1 / d on the diagonal
Z | 6 free | diag(d)^-1 L^-1 U^T
z | free | diag(d)^-1 L^-1 (tau - H^T e)
W | 6 free | unit columns of H, transposed
"""
_CONNECTION = """
R | 9 | inboard hinge axes to parent axes
r | 3 | Q in the parent
motion | 9 | bias motion of the inboard hinge frame
w | 3 | its angular velocity
"""
_MODES = """
eta | n | modal coordinates
etad | n | modal rates
qdot | n | rates of the modal coordinates
udot | n | modal accelerations
etadd | n | stored modal accelerations
given | n | given modal accelerations of inverse dynamics
efforts | n | efforts of the caller on the modes
required | n | efforts required by the given modal accelerations
column | n | right-hand side of a solution
answer | n | modal accelerations, the solution
K | n n | stiffness
D | n n | damping
S_rf | 6 n | frame rows, modal columns
S_rf_I | 6 n | S_rf relative to the supported section
A | 6 n | acceleration of second order by modal rates
A_drag | 6 n | the same with the drag as density
S_ff | n n | modal rows and columns
e_f | n | force part of the modal rows
right | 7 n | right-hand sides of the modal elimination
gain | 7 n | etadd = g - G a: columns of G, then -g
work | n n | factor of S_ff
load_effort | n | efforts on the modes by a load
"""
_SECTION = """
Phi | 6 n | shapes at the section
x | 3 | position of the section in the frame
Psi | 3 | rotation vector of the section
xd | 3 | its velocity
Psid | 3 | its rate of rotation
xdd | 3 | bias of the position
Psidd | 3 | bias of rotation
H6 | 36 | motion of the end by motion of the section
H | 6 n | motion subspace of the modes
push | 6 n | S H of the bodies outboard of the section
b | 18 | strains of a segment at rest
Bm | 18 n | strains of a segment per strain coordinate
dC1 | 6 n | derivatives of the term C1 of the Magnus series
dC2 | 6 n | derivatives of its term C2
dX | 6 n | derivatives of its term X
Om | 6 | displacement and rotation vector along a segment
Omd | 6 | its rate
Omdd | 6 | its bias
S_rf | 6 n | frame rows, modal columns of the stations outboard of a segment
end | 9 | axes of the end in the section
"""
_OTHER_SLOTS = """
link.b | 11 | numbers of the rigid body, and the rotor inertia of its hinge
link.p | 1 | number of the hinge
link.numbers | 5 | screws about x and z from link to link; rotation and place (12) of a ball
link.q | nq | coordinates; of a turned hinge with its constant angle
link.u | nu | speeds
link.qdot | nq | rates of the coordinates
link.udot | nu | accelerations
link.tau | nu | efforts
link.turn | 2 | angle, then its cosine and sine; rotation (9) of a ball
link.shift | 1 | along z
link.lift | 3 | constant shift of the hinge's own screw
link.motion | 9 | bias motion; after recovery the deviation
link.load | 6 | e of the body alone
link.G | 6 nu | udot = g - G a; of a ball the system that remains to be solved
link.g | nu | udot = g - G a
outer.motion | 9 | bias motion of the inboard body
outer.delta | 6 | deviation of the inboard body
outer.S | 21 | S carried to the inboard body
outer.e | 6 | e carried to the inboard body
inner.S | 21 | S of the outboard bodies
inner.e | 6 | e of the outboard bodies
closure.turn | 9 | rotation, axes of C to axes of B where the loop is closed
closure.end | 3 | the end of B at the hinge, axes of B
closure.p | 5 | numbers of a constraint
closure.R_C | 9 | rotation, axes of C to axes of B
closure.d | 3 | the end of B from the origin of C, axes of C
closure.lever | 3 | the end of B from P of A, axes of A
closure.gap | 6 | gap, axes of C
closure.slip | 6 | relative motion of the end of B, axes of C
closure.W | 36 | directions: free speeds, then constrained ones; a row each
closure.J_A | 36 | rows by the acceleration of A
closure.J_B | 36 | rows by the acceleration of B
closure.l | 6 | known parts of the rows
side.inner | 6 | column of the current row, on the side of A
side.outer | 6 | column of the current row, on the side of B
line.known | 1 | known part of the current row
line.x | 1 | its multiplier
line.previous_x | 1 | its multiplier in the previous solution
line.softness | 1 | 1 / inertia of the rotor on it
row.K | 6 | column on the body where the row closes
row.known | 1 | known part
row.pivot | 1 | its own entry of L
row.inverse | 1 | 1 / L, zero for a row without inertia
row.x | 1 | multiplier
row.floor | 1 | largest pivot that counts as rounding
other.K | 6 | column of a row that stays open
other.known | 1 | its known part
other.x | 1 | its multiplier
other.L | 1 | its entry of L with the row that closes
second.L | 1 | entry of L of another open row with the row that closes
both.L | 1 | entry of L of the two rows that stay open
pending.K | 6 | column of an open row
pending.onward | 6 | its column on the parent
pending.y | free | -H^T K
pending.z | free | diag(d)^-1 L^-1 y
pending.known | 1 | its known part
pending.x | 1 | its multiplier
pending.previous_x | 1 | its multiplier in the previous solution
pending.tau | nu | -C: efforts of a unit multiplier on the speeds of the hinge
before.y | free | -H^T K of another open row
pair.L | 1 | entry of L of both
own.tau | nu | -C of a coupling, on own speeds of a hinge that closes a loop
own.inner | 6 | column of the coupling on the side of A
own.outer | 6 | column of the coupling on the side of B
own.known | 1 | its known part
own.x | 1 | its multiplier
own.previous_x | 1 | its multiplier in the previous solution
coupling.x | 1 | multiplier of a coupling
coupling.time_rate | 1 | rate at zero speeds, due to the prescribed value
coupling.previous_x | 1 | its multiplier in the previous solution
pending.modes | n | its column on the modes of the body that an end belongs to
bent.K | 6 | column of a row that passes or ends at a flexible body, on the frame
bent.modes | n | column of this row on the modes
bent.y | n | S_ff^-1 times the modal column
bent.known | 1 | its known part
bent.x | 1 | its multiplier
bent_before.modes | n | column of another such row on the modes
bent_pair.L | 1 | entry of L of both
drive.value | 1 | value of the drive
drive.rate | 1 | its rate
drive.acceleration | 1 | its acceleration
drive.q | 1 | the coordinate
drive.u | 1 | the speed
drive.s | 1 | the prescribed acceleration
speed.effort | 1 | effort of the caller
speed.u | 1 | speed
law.p | np | numbers of the law
law.q | nq | coordinates that it reads
law.u | nu | speeds that it reads
law.effort | nu | its given efforts, places among the expression values
law.axes | 9 | axes of springs
law.turn | 1 | turns counted so far
law.tau | nu | efforts on its speeds
load.axes_own | 9 | axes of the components in the body that they belong to
load.offset | 3 | point, body axes
load.force | 3 | places among the expression values
load.moment | 3 | places among the expression values
force.p | np | numbers of the element
force.effort | 1 | its given effort, an expression
force.offset_F | 3 | end F, body axes
force.offset_T | 3 | end T, body axes
force.axes_F | 9 | axes of end F
force.axes_T | 9 | axes of end T
scene.t | 1 | time
sums.power | 1 | power of everything that is not stored
sums.potential | 1 | potential of springs, laws and strain
given.S | 21 | requested mass matrix
given.h | 6 | requested momentum
given.T | 1 | requested energy
tangent.S | 54 | change of the load at P by the motion, a row per entry of the motion
tangent.B | 9 nu | change of motion along the free speeds, a row a speed
tangent.G | 6 nu | change of the carried load, a row a speed
tangent.W | nu nu | change of the rows by load and laws, a row a speed
tangent.laws | nu nu | change of the laws' efforts, a row a speed
tangent.H | 6 nu | columns of H of the free speeds
tangent.V | 6 nu | load by the unknowns, a row a speed
tangent.gain | 9 nu | rows by the motion, divided by those by the unknowns
tangent.inverse | nu nu | inverse of the rows by the unknowns
tangent.y | nu | remainder of the rows, divided by those by the unknowns
tangent.known | 9 | known change of motion across the connection
place.S | 54 | change of the load at P by the displacement, a row per entry
place.z | 9 | displacement: rotation, position and velocity of P, own axes
place.known | 9 | known displacement across the connection
place.B | 9 nu | displacement along the free speeds, a row a speed
place.gain | 9 nu | rows by the displacement, divided by those by the unknowns
tangent.along | nq nu | change of the coordinates along the speeds, a row a speed
tangent.rates_by_coordinates | nq nq | derivatives of the rates by the coordinates, by rows
tangent.rates_by_speeds | nq nu | derivatives of the rates by the speeds, a row a speed
tangent.unit | nq nq | unit matrix
tangent.rates | nq nq | sq 1 - kappa times the derivatives of the rates
tangent.Q | nq nq | its inverse
tangent.Q_work | nq nq | its factors
bend.B | 9 n | change of motion along the modes, a row a mode
bend.G | 6 n | change of the carried load
bend.W | n n | change of the rows by the carried load
bend.zero_H | 6 n | zero subspace of a frame that is supported by a hinge
bend.K | 6 n | own load along the modes
bend.Z_z | 9 n | own rows by the motion, a row an entry
bend.Z_x | n n | own rows by the modes, a row a mode
bend.V | 6 n | load by the unknowns
bend.D | n n | rows by the unknowns
bend.right | 9 n | rows by the motion
bend.gain | 9 n | D^-1 times the rows by the motion
bend.place_B | 9 n | displacement along the modes, a row a mode
bend.place_Z | 9 n | own rows by the displacement, a row an entry
bend.place_right | 9 n | rows by the displacement
bend.place_gain | 9 n | D^-1 times the rows by the displacement
bend.work | n n | factors of D
bend.rest | n | remainder of the rows
bend.y | n | D^-1 times the remainder
port.B | 9 n | as bend.B, of an end that follows the modes
port.place_B | 9 n | as bend.place_B
port.G | 6 n | as bend.G
port.W | n n | as bend.W
port.K | 6 n | S B of the bodies outboard of the end
port.S_rf | 6 n | as section.S_rf, of the mass matrix with laws
port.outboard_K | 6 n | load along the modes of the stations outboard of a segment
port.outboard_Z_z | 9 n | rows by the motion of these stations, a row an entry
port.outboard_Z_p | 9 n | rows by the displacement of these stations, a row an entry
law.own_slopes | nu | change of the law's efforts along one of its own speeds
mass.S | 21 | S of the outboard bodies, including derivatives of the laws
mass.F | nu nu | D = L diag(d) L^T: L, and 1 / d on the diagonal
mass.G | 6 nu | D^-1 H^T S
inboard.mass | 21 | mass.S of the parent
shapes.S_rf | 6 n | frame rows, modal columns, of the mass matrix
shapes.S_rf_I | 6 n | shapes.S_rf relative to the supported section
shapes.S_ff | n n | modal rows and columns, including stiffness and damping
shapes.right | 7 n | right-hand sides of the modal elimination
shapes.gain | 7 n | etadd = g - G a: columns of G, then -g
law.slopes | nu | change of the law's efforts along the current speed
inboard.S | 54 | tangent.S of the parent
inboard.S_rf | 6 n | section.S_rf of the station before, or modes.S_rf
inboard.shapes_S_rf | 6 n | port.S_rf of the station before, or shapes.S_rf
inboard.K | 6 n | port.outboard_K of the station before, or bend.K
inboard.Z_z | 9 n | port.outboard_Z_z of the station before, or bend.Z_z
inboard.Z_p | 9 n | port.outboard_Z_p of the station before, or bend.place_Z
inboard.place | 54 | place.S of the parent
inboard.z | 9 | place.z of the parent
step.rate | 1 | change of the speeds along the unknowns
step.s | 1 | change of the accelerations along the unknowns
step.closing | 1 | acceleration that closes a unit gap within a step
step.q | 1 | inverse time step of the coordinates
step.kappa | 1 | whether derivatives of the rates are included
body.rho | nq | residual of the rates
body.change | nq | change of the coordinates
"""


def _rows(owner: str, text: str) -> list[Slot]:
    rows = [[word.strip() for word in line.split("|")] for line in text.strip().split("\n")]
    return [
        Slot(f"{owner}.{name}" if owner else name, size, meaning) for name, size, meaning in rows
    ]


#: All slots except local ones, whose size is that of their port.
SLOTS: dict[str, Slot] = {
    slot.name: slot
    for slot in (
        *_rows("body", _BODY), *_rows("hinge", _HINGE), *_rows("connection", _CONNECTION),
        *_rows("modes", _MODES), *_rows("section", _SECTION), *_rows("", _OTHER_SLOTS),
    )
}  # fmt: skip

#: trait -> its condition.
TRAITS: dict[str, str] = {
    "own": "the hinge is swept by its own kernels, one per pass",
    "parts": "the hinge's motion is known; generic steps sweep across it",
    "whole": "by parts, with one kernel for the motion across the hinge and of the body",
    "directed": "a kernel of the hinge gives all its directions; no position-dependent loads",
    "staged": "by parts, and stage by stage: code for one scene, in which known values fold",
    "axial": "the hinge is a screw about z that leaves its H unchanged",
    "special": "every speed is free and without rotor, and the hinge has its own elimination",
    "free": "some speed is free",
    "imposed": "some speed is prescribed, or locked until its release",
    "on_body": "the parent is a body, not the ground",
    "link": "the connection is a screw about x, with a constant part of the hinge's own screw",
    "rotated": "the constant part of the screw includes a rotation",
    "idle": "an end without outboard bodies or loads that is not observed",
    "modal": "the floating frame of a flexible body",
    "section": "the connection passes a section of a flexible body",
    "outward": "from the frame out to an end",
    "segment": "from one station of an exact beam out to the next, or to an end",
    "drag": "a flexible body with viscous drag",
    "known": "the motion of hinges is known",
    "coordinate": "a law on one coordinate (otherwise on a quaternion and its turns)",
    "effort": "the element has a given effort",
    "efforts": "the caller adds efforts",
    "balance": "power and potential are requested",
    "inverse": "accelerations are given",
    "weightless": "only efforts are requested, without the inertia of bodies",
    "driving": "accelerations are prescribed: none are given, or a residual is requested",
    "moving": "the hinge has a free speed",
    "curved": "the rates of the coordinates are not the speeds",
    "turning": "the hinge is steady and only rotates",
    "steady": "the motion subspace is constant in body axes",
    "linked": "consecutive links are swept as links",
    "laws": "the scene has hinge laws",
    "driven": "the scene has prescribed motion",
    "expressions": "efforts or loads are expressions",
    "flexible": "the scene has flexible bodies",
    "placed": "loads on the body or outboard of it depend only on its position",
    "own_load": "the load depends only on the position of its body",
    "from_body": "its end F is on a body, not on the ground",
    "to_body": "its end T is on a body, not on the ground",
    "own_force": "the element is between a body and the ground",
    "poses": "loads or force elements need poses",
    "shifted": "some increments of a right-hand side are known",
    "unit_load": "the right-hand side contains a unit load",
    "looped": "the scene has closed loops",
    "cut": "the hinge closes a loop",
    "loop_hinge": "the hinge that a law acts on closes a loop",
    "hinged": "a hinge closes the loop: free and constrained directions make six",
    "distance": "the constraint keeps a distance",
    "plane": "the constraint keeps a point on a plane",
    "rolling": "the constraint is that of a rolling disc or ball",
    "omitted": "the hinge closes a loop, or the body is idle",
    "residual": "required efforts are requested with the multipliers of closed loops",
    "corrected": "a position gap or a velocity error is corrected",
    "soft": "the row is that of a rotor",
    "refined": "the residual of a previous solution is solved for, and added to it",
    "inside": "the row closes on a body, not at the ground, whose deviation is zero",
    "immobile": "the row has no inertia in any position: code for one scene omits it",
    "couplings": "coordinates are coupled",
    "redundant": "the coupling is redundant",
    "coupled": "the open row is a coupling of the hinge's speeds",
    "gap_closing": "accelerations close gaps within a step",
    "position_gap": "a position gap is corrected",
    "velocity_error": "a velocity error is corrected",
    "qr": "the least-squares sweep is used",
    "rigid": "the body is the built-in rigid one",
    "loads_read": "S and e are read after the sweep",
    "product": "the product of classical matrices is requested",
}
