"""The words of the schedule: what each slot holds and what each trait asks.

A slot is "owner.name".  `parent`, `on`, `axes`, `from` and `to` stand for the body that is meant,
`modes` for the flexible body that a section belongs to; `local` lives for one subject of one pass.
"[4 7]" behind a slot picks entries, "[k]" the entry of the speed at hand.  Sizes: numbers, nu and
free (speeds of the hinge, those nobody imposes), n (modes), nq.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Constants that any port may read; as long as the port.
CONSTANTS = {
    "identity": "axes without a turn", "zero": "zeros", "none": "no numbers at all",
    "plane": "the own motion of a pin about z and what it holds, row by row",
}  # fmt: skip

#: Owners that stand for a body by its role.
ROLES = ("parent", "on", "axes", "from", "to", "outboard", "meeting")


@dataclass(frozen=True)
class Slot:
    """What a slot holds; `size` is a product of numbers and names."""

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
floor | 2 | least inertia along and about an axis that is not rounding
s | nu | prescribed part of the accelerations
tau | nu | efforts on the speeds
chosen | nu | accelerations that stop the bias motion along free directions
own | 21 | S of the body alone
U | 21 | rows of everything outboard, S = U^T U: the upper triangle
d | 6 | load that the rows take, f = U^T (U a + d) + e
w | 3 | angular velocity, own axes: the first of `motion`
p | np | numbers of the body's kernels
q | nq | coordinates of the hinge
u | nu | speeds of the hinge
rotor | nu | inertia of rotors reflected to the speeds
given | nu | accelerations that inverse dynamics is asked for
efforts | nu | efforts of the caller
qdot | nq | rates of the coordinates
udot | nu | accelerations
required | nu | efforts that given accelerations need
column | nu | right-hand side of a solution
answer | nu | accelerations that answer it
"""
_HINGE = """
R | 9 | rotation across the hinge, outboard to inboard hinge axes
d | 3 | P from Q, inboard hinge axes
H | 6 nu | motion subspace
v | 3 | relative velocity, outboard axes
w | 3 | relative angular velocity, outboard axes
c | 6 | acceleration at rest in the speeds
p | np | numbers of the hinge's kernels
G | 6 nu | udot = g - G a
g | nu | udot = g - G a
rates | nu | accelerations of the free speeds
H_free | 6 free | columns of H that nobody imposes
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
etadd | n | modal accelerations, kept
given | n | modal accelerations that inverse dynamics is asked for
efforts | n | efforts of the caller on the modes
required | n | efforts that given modal accelerations need
column | n | right-hand side of a solution
answer | n | modal accelerations that answer it
K | n n | stiffness
D | n n | damping
S_rf | 6 n | frame rows, modal columns
based | 6 n | the same seen from the section that is held
A | 6 n | acceleration of second order by modal rates
A_drag | 6 n | the same under the density of the drag
S_ff | n n | modal rows and columns
e_f | n | force part of the modal rows
right | 7 n | right-hand sides of the modal elimination
gain | 7 n | etadd = g - G a: columns of G, then -g
work | n n | factor of S_ff
felt | n | efforts on the modes
"""
_SECTION = """
Phi | 6 n | shapes at the section
x | 3 | place of the section in the frame
Psi | 3 | rotation vector of the section
xd | 3 | its rate of place
Psid | 3 | its rate of rotation
xdd | 3 | bias of place
Psidd | 3 | bias of rotation
H6 | 36 | motion of the end by motion of the section
H | 6 n | motion subspace of the modes
push | 6 n | S H of what hangs on the section
end | 9 | axes of the end in the section
"""
_OTHERS = """
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
link.G | 6 nu | udot = g - G a; of a ball what is left of that to be solved
link.g | nu | udot = g - G a
outer.motion | 9 | bias motion of what the link hangs on
outer.delta | 6 | deviation of what the link hangs on
outer.S | 21 | S handed on to what the link hangs on
outer.e | 6 | e handed on
inner.S | 21 | S of what hangs on the link
inner.e | 6 | e of what hangs on the link
closure.turn | 9 | rotation, axes of C to axes of B where the loop is closed
closure.end | 3 | the end of B that the hinge holds, axes of B
closure.p | 5 | numbers of a constraint
closure.R_C | 9 | rotation, axes of C to axes of B
closure.d | 3 | the end of B from the origin of C, axes of C
closure.lever | 3 | the end of B from P of A, axes of A
closure.gap | 6 | gap, axes of C
closure.slip | 6 | relative motion of the end of B, axes of C
closure.W | 36 | directions: own speeds, then what the hinge holds; a row each
closure.J_A | 36 | rows by the acceleration of A
closure.J_B | 36 | rows by the acceleration of B
closure.l | 6 | rows of what is known
side.inner | 6 | column of the row at hand, on the side of A
side.outer | 6 | column of the row at hand, on the side of B
line.known | 1 | known part of the row at hand
line.x | 1 | its multiplier
line.told | 1 | its multiplier in the answer before
line.softness | 1 | 1 / inertia of the rotor on it
row.K | 6 | column on the body where the row closes
row.known | 1 | known part
row.pivot | 1 | its own entry of L
row.inverse | 1 | 1 / L, zero for a row that nothing moves
row.x | 1 | multiplier
row.floor | 1 | largest pivot that is rounding
other.K | 6 | column of a row that stays
other.known | 1 | its known part
other.x | 1 | its multiplier
other.L | 1 | its entry of L with the row that closes
second.L | 1 | entry of L of another that stays with the row that closes
both.L | 1 | entry of L of the two that stay
pending.K | 6 | column of a row that is open
pending.onward | 6 | its column on the parent
pending.y | free | -H^T K
pending.z | free | diag(d)^-1 L^-1 y
pending.known | 1 | its known part
pending.x | 1 | its multiplier
pending.told | 1 | its multiplier in the answer before
pending.tau | nu | -C: efforts of a multiplier of one on the speeds of the hinge
before.y | free | -H^T K of another open row
pair.L | 1 | entry of L of both
own.tau | nu | -C of a coupling, on own speeds of a hinge that closes a loop
own.inner | 6 | column of the coupling on the side of A
own.outer | 6 | column of the coupling on the side of B
own.known | 1 | its known part
own.x | 1 | its multiplier
own.told | 1 | its multiplier in the answer before
coupling.x | 1 | multiplier of a coupling
coupling.still | 1 | its rate at rest, by what it is to equal
coupling.told | 1 | its multiplier in the answer before
pending.modes | n | its column on the modes of the body that an end belongs to
bent.K | 6 | column of a row that passes or ends at a flexible body, on the frame
bent.modes | n | the same on the modes
bent.y | n | S_ff^-1 times it
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
given.S | 21 | mass matrix asked for
given.h | 6 | momentum asked for
given.T | 1 | energy asked for
tangent.S | 54 | change of the load at P by that of the motion, a row an entry of the motion
tangent.B | 9 nu | change of motion along the free speeds, a row a speed
tangent.G | 6 nu | change of the load that is carried, a row a speed
tangent.W | nu nu | change of the rows by load and laws, a row a speed
tangent.laws | nu nu | change of the laws' efforts, a row a speed
tangent.H | 6 nu | columns of H of the free speeds
tangent.V | 6 nu | load by the unknowns, a row a speed
tangent.gain | 9 nu | rows by the motion, divided by those by the unknowns
tangent.inverse | nu nu | inverse of the rows by the unknowns
tangent.y | nu | what is left of the rows, divided by those by the unknowns
tangent.known | 9 | change of motion across the connection that is known
place.S | 54 | change of the load at P by that of the place, a row an entry of the place
place.z | 9 | change of the place: turn, place and velocity of P, own axes
place.known | 9 | change of place across the connection that is known
place.B | 9 nu | change of place along the free speeds, a row a speed
place.gain | 9 nu | rows by the place, divided by those by the unknowns
tangent.along | nq nu | change of the coordinates along the speeds, a row a speed
tangent.turns | nq nq | slopes of the rates by the coordinates, a row a coordinate
tangent.ways | nq nu | slopes of the rates by the speeds, a row a speed
tangent.unit | nq nq | unit matrix
tangent.rates | nq nq | sq 1 - kappa times the slopes of the rates
tangent.lag | nq nq | its inverse
tangent.lag_work | nq nq | its factors
bend.B | 9 n | change of motion along the modes, a row a mode
bend.G | 6 n | change of the load that is carried
bend.W | n n | change of the rows by it
bend.still | 6 n | no subspace: a frame that is held by a hinge
bend.K | 6 n | own load along the modes
bend.Z_z | 9 n | own rows by the motion, a row an entry
bend.Z_x | n n | own rows by the modes, a row a mode
bend.V | 6 n | load by the unknowns
bend.D | n n | rows by the unknowns
bend.right | 9 n | rows by the motion
bend.gain | 9 n | D^-1 times them
bend.place_B | 9 n | change of place along the modes, a row a mode
bend.place_Z | 9 n | own rows by the place, a row an entry
bend.place_right | 9 n | rows by the place
bend.place_gain | 9 n | D^-1 times them
bend.work | n n | factors of D
bend.rest | n | what is left of the rows
bend.y | n | D^-1 times it
port.B | 9 n | as bend.B, of an end that follows the modes
port.place_B | 9 n | as bend.place_B
port.G | 6 n | as bend.G
port.W | n n | as bend.W
port.K | 6 n | S B of what hangs on the end
law.own_slopes | nu | the same along a speed of the law's own
mass.S | 21 | S of what hangs on the parent, the laws' slopes in it
mass.F | nu nu | D = L diag(d) L^T: L, and 1 / d on the diagonal
mass.G | 6 nu | D^-1 H^T S
inboard.mass | 21 | mass.S of the parent
shapes.S_rf | 6 n | frame rows, modal columns, of the mass matrix
shapes.based | 6 n | the same seen from the section that is held
shapes.S_ff | n n | modal rows and columns, stiffness and damping in them
shapes.right | 7 n | right-hand sides of the modal elimination
shapes.gain | 7 n | etadd = g - G a: columns of G, then -g
law.slopes | nu | change of the law's efforts along the speed at hand
inboard.S | 54 | tangent.S of the parent
inboard.place | 54 | place.S of the parent
inboard.z | 9 | place.z of the parent
step.rate | 1 | change of the speeds along the unknowns
step.s | 1 | change of the accelerations along them
step.closing | 1 | accelerations that close a gap of one within a step
step.q | 1 | inverse time by which coordinates follow speeds
step.kappa | 1 | whether the rates' own slopes count
body.rho | nq | what the rates lack
body.change | nq | change of the coordinates
"""


def _rows(owner: str, text: str) -> list[Slot]:
    rows = [[word.strip() for word in line.split("|")] for line in text.strip().split("\n")]
    return [Slot(f"{owner}.{name}" if owner else name, size, said) for name, size, said in rows]


#: Every slot but the local ones, whose size is that of the port that fills them.
SLOTS: dict[str, Slot] = {
    slot.name: slot
    for slot in (
        *_rows("body", _BODY), *_rows("hinge", _HINGE), *_rows("connection", _CONNECTION),
        *_rows("modes", _MODES), *_rows("section", _SECTION), *_rows("", _OTHERS),
    )
}  # fmt: skip

#: Numbers of fields, by the names of the ports that read them.
FIELDS = ("moments", "drag", "section")

#: trait -> what it asks.
TRAITS: dict[str, str] = {
    "own": "the hinge's own kernels sweep across it, one a pass",
    "parts": "the hinge's motion is known; the steps for any hinge sweep across it",
    "whole": "by parts, where one kernel gives the motion across the hinge and that of the body",
    "directed": "a kernel of the hinge gives all its directions, nothing that goes by place",
    "staged": "by parts, and stage by stage: code for one scene, in which what is known folds",
    "axial": "the hinge is a screw about z that leaves its H as it is",
    "special": "every speed is free and without rotor, and the hinge has its own elimination",
    "free": "some speed is not imposed",
    "imposed": "some speed is driven, or held until its release",
    "hung": "the parent is a body, not the ground",
    "link": "the connection is a screw about x, with a constant part of the hinge's own screw",
    "turned": "that constant part turns",
    "idle": "an end that nothing hangs on or acts on, and nobody observes",
    "modal": "the floating frame of a flexible body",
    "section": "the connection passes a section of a flexible body",
    "outward": "from the frame out to an end",
    "drag": "a flexible body with viscous drag",
    "known": "hinges have their motion already",
    "coordinate": "a law on one coordinate (otherwise on a quaternion and its turns)",
    "effort": "the element has a given effort",
    "efforts": "the caller adds efforts",
    "balance": "power and potential are wanted",
    "inverse": "accelerations are given",
    "weightless": "efforts are asked for, which no pass needs the inertia of bodies for",
    "driving": "drives give accelerations: none are given, or a residual is asked for",
    "moving": "a hinge, some speed of which is not imposed",
    "curved": "the rates of the coordinates are not the speeds",
    "turning": "the hinge is steady and has turns alone",
    "steady": "the motions of the hinge are the same in every position, seen from the body",
    "linked": "runs of links are swept as such",
    "laws": "there are laws",
    "driven": "there are drives",
    "valued": "efforts or loads are expressions",
    "flexible": "there are flexible bodies",
    "placed": "loads on the body or outboard of it change with its place and nothing else",
    "own_load": "the load changes with the place of its body and nothing else",
    "from_body": "its end F is on a body, not on the ground",
    "to_body": "its end T is on a body, not on the ground",
    "own_force": "the element is between a body and the ground",
    "posed": "loads or force elements need poses",
    "shifted": "some increments of a right-hand side are known",
    "united": "a load is one in a right-hand side",
    "looped": "loops are closed",
    "cut": "the hinge closes a loop",
    "shut": "the hinge that a law acts on closes a loop",
    "hinged": "its own speeds and what it holds part six directions",
    "distance": "a constraint keeps a distance",
    "plane": "a constraint holds a point on a plane",
    "rolling": "a constraint is of a rolling disc or ball",
    "aside": "the hinge closes a loop, or the body is idle",
    "residual": "what accelerations need is asked for with the multipliers of closed loops",
    "corrected": "a gap or a slip is to be corrected",
    "soft": "the row is that of a rotor",
    "refined": "what an answer before leaves over is answered, and added to it",
    "inside": "the row closes on a body, not at the ground, which keeps to its bias motion",
    "unmoved": "nothing moves the row in any position: code for one scene goes without it",
    "couplings": "coordinates are coupled",
    "unmet": "other rows do what the coupling asks",
    "coupled": "the open row is a coupling of the hinge's speeds",
    "placing": "gaps are to be closed by accelerations within a step",
    "gaping": "a gap",
    "slipping": "a slip",
    "qr": "the sweep is that of least squares",
    "rigid": "the body is the built-in rigid one",
    "kept": "somebody reads S and e behind the sweep",
    "product": "the product of classical matrices is asked for too",
}
