"""Parser of scene expressions: text to a flat list of terms, without recursion or eval.

    comparison := sum [("<" | "<=" | ">" | ">=") sum]
    sum        := product {("+" | "-") product}
    product    := factor {("*" | "/") factor}
    factor     := ("-" | "+") factor | power
    power      := atom ["^" factor]                      (right associative: 2^3^2 = 2^9)
    atom       := number | "pi" | "deg" | name | "(" .. ")"
                  | function "(" comparison {"," comparison} ")"
    name       := word [place] {"." word} ["[" whole number "]"]
    place      := "[" (whole number | "last") "]"        (of a chain's member, as in rope[3].tip.x)

`deg` is pi/180; the name of a constant is replaced by its value.

An operator stack (shunting yard) replaces the call stack, so that no text can overflow it.
"""

from __future__ import annotations

import difflib
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from ..errors import ExpressionError
from ..ir import OPERATIONS

MAX_EXPRESSION_LENGTH = 4000
MAX_DEPTH = 100
MAX_NAME_LENGTH = 64
#: Most bits of an exact constant; longer ones are rounded to double precision.
_MAX_EXACT_BITS = 2100

#: Function name -> number of arguments (None: two or more).
FUNCTIONS: dict[str, int | None] = {
    **{name: OPERATIONS[name].arity for name in (
        "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
        "sqrt", "abs", "sign",
    )},
    "min": None, "max": None, "where": OPERATIONS["select"].arity,
}  # fmt: skip

COMPARISONS = {"<": "lt", "<=": "le", ">": "gt", ">=": "ge"}
_OPERATORS = {"+": ("add", 2), "-": ("sub", 2), "*": ("mul", 3), "/": ("div", 3), "^": ("pow", 5)}
_PREFIX_PRECEDENCE = 4

_TOKEN = re.compile(
    r"(?P<space>[ \t\r\n]+)"
    r"|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:\[(?:[0-9]{1,8}|last)\](?=\.))?"
    r"(?:\.[A-Za-z_][A-Za-z0-9_]*)*(?:\[[0-9]{1,6}\])?)"
    r"|(?P<symbol><=|>=|[-+*/^<>(),])"
)
_REMEDIES = {
    "**": "write ^ for a power",
    "=": "a comparison is one of < <= > >=",
    "!": "a comparison is one of < <= > >=",
    "&": "nest where(condition, a, b) to combine conditions",
    "|": "nest where(condition, a, b) to combine conditions",
    "[": "an index follows its name directly and is a whole number, as in q[0]",
    "]": "an index follows its name directly and is a whole number, as in q[0]",
    "%": "the functions are " + ", ".join(FUNCTIONS),
    "\N{MINUS SIGN}": "write the plain - of the keyboard",
    "\N{MIDDLE DOT}": "write * for a product",
    "\N{MULTIPLICATION SIGN}": "write * for a product",
    "'": "an expression cannot contain text",
    '"': "an expression cannot contain text",
}

#: Longest expression that messages show whole; of longer ones they show the part with the error.
_MAX_SHOWN_LENGTH = 80


def mark_position(text: str, position: int) -> str:
    """Position in an expression as text: character number, and the text around it with an arrow."""
    text_before, text_after = text[max(0, position - 30) : position], text[position:]
    text_before = ("..." if position > 30 else "") + text_before
    text_after = text_after[:30] + ("..." if len(text_after) > 30 else "")
    marked_text = f"{text_before} -->{text_after}".encode("unicode_escape").decode("ascii")
    return f"character {position + 1}: {marked_text.strip()}"


@dataclass(frozen=True)
class Name:
    """Name in an expression: `rod1.tip.x` has parts ("rod1", "tip", "x"), `q[1]` the index 1.

    Names of chain members are such as `rope[3].tip.x` and `rope[3].hinge.q`.
    """

    parts: tuple[str, ...]
    index: int | None = None
    position: int = field(default=0, compare=False)

    @property
    def text(self) -> str:
        """Text of the name."""
        return ".".join(self.parts) + ("" if self.index is None else f"[{self.index}]")

    @property
    def owner(self) -> str:
        """Hinge or body of the name; "" for `t`, and for `q`, `u` and parameters of the element."""
        return self.parts[0] if len(self.parts) > 1 else ""

    @property
    def hinge(self) -> str:
        """Hinge of a `q` or `u`: "shoulder" or "rope[3].hinge"; "" for the element's own."""
        return ".".join(self.parts[:-1])

    @property
    def is_member(self) -> bool:
        """Whether the name begins with a chain member."""
        return self.parts[0].endswith("]")

    @property
    def quantity(self) -> str:
        """Last part of the name: t, q, u, x, y, z, vx, vy, vz or the name of a parameter."""
        return self.parts[-1]


def context_of_name(text: str, name: Name) -> str:
    """Expression that contains a name, for the end of a message; shortened where it is long."""
    if text == name.text:
        return ""
    return (
        f" (in {text!r})"
        if len(text) <= _MAX_SHOWN_LENGTH
        else f" ({mark_position(text, name.position)})"
    )


@dataclass(frozen=True)
class Term:
    """Operation of a parsed expression; `args` are indices of earlier terms of the same list.

    `op` is number, pi, name, a comparison (lt le gt ge), an arithmetic operation or a function.
    `exact` is the rational value of a constant term, `constant` its value in double precision.
    """

    op: str
    args: tuple[int, ...]
    start: int
    end: int
    exact: Fraction | None = None
    constant: float | None = None
    name: Name | None = None

    @property
    def is_condition(self) -> bool:
        return self.op in ("lt", "le", "gt", "ge")


def _comparison_function(holds: Callable[[Any, Any], bool]) -> Callable[[Any, Any], float]:
    """Comparison as a number: 1 or 0, or nan where either argument is nan."""
    return lambda a, b: float(holds(a, b)) if a == a and b == b else math.nan


#: Functions of all operations in double precision, with the same values as in C.
OPERATION_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: row.value for name, row in OPERATIONS.items()},
    **{name: _comparison_function(getattr(operator, name)) for name in ("lt", "le", "gt", "ge")},
    "where": lambda condition, a, b: (
        (a if condition else b) if condition == condition else condition
    ),
}

#: Operations with an exact value on fractions.
_EXACT_OPERATIONS = frozenset({
    "neg", "add", "sub", "mul", "div", "abs", "min", "max", "lt", "le", "gt", "ge", "where", "sign",
})  # fmt: skip


@dataclass
class _PendingOperator:
    """Operator or open parenthesis on the stack; `op` of a parenthesis is "(" or a function."""

    op: str
    precedence: int
    position: int
    arguments: int = 0
    is_group: bool = False


class Parser:
    """Parser of one expression; `run` fills `terms` and returns the index of the root.

    `constants` maps names to numbers; `used_constants` are the constants that the text contains.
    """

    def __init__(self, text: str, constants: Mapping[str, float] | None = None) -> None:
        self.text = text
        self.used_constants: dict[str, float] = {}
        self._constants = {} if constants is None else constants
        self.terms: list[Term] = []
        self._operands: list[tuple[int, int, int]] = []  # term, start and end with parentheses
        self._pending_operators: list[_PendingOperator] = []
        self._depth = 0

    def error(self, message: str, position: int) -> ExpressionError:
        """ExpressionError with its position marked by an arrow in the text."""
        return ExpressionError(f"{message} ({mark_position(self.text, position)})")

    # --- the loop over tokens ---------------------------------------------------------------

    def run(self) -> int:
        """Parse the whole text; return the index of the outermost term."""
        expects_operand, position = True, 0
        while position < len(self.text):
            match = _TOKEN.match(self.text, position)
            if match is None:
                raise self._unknown_character(position)
            kind, token = str(match.lastgroup), match.group()
            if kind != "space":
                if expects_operand:
                    expects_operand, end = self._operand(kind, token, position, match.end())
                else:
                    expects_operand, end = self._operator(kind, token, position), match.end()
                position = end
            else:
                position = match.end()
        if expects_operand:
            raise self.error("the expression ends where a value is expected", len(self.text))
        self._reduce_to_group()
        if self._pending_operators:
            open_position = self._pending_operators[-1].position
            raise self.error("this parenthesis is not closed; add )", open_position)
        return self._operands[-1][0]

    def _unknown_character(self, position: int) -> ExpressionError:
        character = self.text[position]
        remedy = _REMEDIES.get(character, "see the grammar: numbers, names, + - * / ^, functions")
        return self.error(f"{character!a} is not part of an expression; {remedy}", position)

    def _operand(self, kind: str, token: str, start: int, end: int) -> tuple[bool, int]:
        """Read an operand: (whether a value is still expected, position of the next token)."""
        if kind == "number":
            self._push(self._number(token, start, end), start, end)
            return False, end
        if kind == "name":
            return self._word(token, start, end)
        if token == "(":
            self._open("(", start)
        elif token == "-":
            self._pending_operators.append(_PendingOperator("neg", _PREFIX_PRECEDENCE, start))
        elif token == ")" and self._pending_operators and self._pending_operators[-1].is_group:
            raise self.error("a value is missing before )", start)
        elif token == "*" and self.text[max(0, start - 1) : start] == "*":
            raise self.error(_REMEDIES["**"], start - 1)
        elif token != "+":
            raise self.error(f"a value is expected before {token}", start)
        return True, end

    def _word(self, token: str, start: int, end: int) -> tuple[bool, int]:
        next_position = end
        while next_position < len(self.text) and self.text[next_position] in " \t\r\n":
            next_position += 1
        if next_position < len(self.text) and self.text[next_position] == "(":
            if token not in FUNCTIONS:
                raise self.error(
                    f"unknown function {token[:MAX_NAME_LENGTH]!r}; {_did_you_mean(token)}", start
                )
            self._open(token, start)
            return True, next_position + 1
        if token == "pi":
            self._push(Term("pi", (), start, end, constant=math.pi), start, end)
            return False, end
        if token == "deg":
            self._push(Term("pi", (), start, end, constant=math.pi), start, end)
            self.terms.append(Term("number", (), start, end, Fraction(180), 180.0))
            self._make("div", (len(self.terms) - 2, len(self.terms) - 1), start, start, end)
            self._operands[-1] = (len(self.terms) - 1, start, end)
            return False, end
        if token in self._constants:
            value = self.used_constants[token] = float(self._constants[token])
            exact = _limit_digits(Fraction(repr(value)), value)
            self._push(Term("number", (), start, end, exact, value), start, end)
            return False, end
        if token in FUNCTIONS:
            raise self.error(f"the function {token} needs its argument in parentheses", end)
        self._push(Term("name", (), start, end, name=self._name(token, start)), start, end)
        return False, end

    def _name(self, token: str, start: int) -> Name:
        name_text, bracket, index = token, "", ""
        if token.endswith("]"):
            name_text, bracket, index = token.rpartition("[")
        parts = tuple(name_text.split("."))
        if len(parts) > 4:
            raise self.error("a name has at most four parts, as in body.end.velocity.x", start)
        if any(len(part.partition("[")[0]) > MAX_NAME_LENGTH for part in parts):
            raise self.error(f"each part of a name has at most {MAX_NAME_LENGTH} characters", start)
        return Name(parts, int(index[:-1]) if bracket else None, start)

    def _operator(self, kind: str, token: str, start: int) -> bool:
        """Read an operator, comma or closing parenthesis; return whether a value must follow."""
        if kind != "symbol" or token == "(":
            raise self.error("an operator is missing here; write * for a product", start)
        if token == ")":
            self._close(start)
            return False
        if token == ",":
            self._comma(start)
            return True
        op, precedence = _OPERATORS.get(token) or (COMPARISONS[token], 1)
        while self._pending_operators and not self._pending_operators[-1].is_group:
            top = self._pending_operators[-1].precedence
            if precedence == 1 and top == 1:
                raise self.error("comparisons cannot be chained; nest where(..) instead", start)
            if top < precedence or (top == precedence and token == "^"):
                break
            self._reduce()
        self._pending_operators.append(_PendingOperator(op, precedence, start))
        return True

    # --- groups and functions ---------------------------------------------------------------

    def _open(self, op: str, start: int) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self.error(f"more than {MAX_DEPTH} nested parentheses", start)
        self._pending_operators.append(_PendingOperator(op, 0, start, is_group=True))

    def _reduce_to_group(self) -> None:
        while self._pending_operators and not self._pending_operators[-1].is_group:
            self._reduce()

    def _comma(self, start: int) -> None:
        self._reduce_to_group()
        if not self._pending_operators or self._pending_operators[-1].op == "(":
            raise self.error(
                "a comma only separates arguments of a function; write decimals with a point", start
            )
        self._pending_operators[-1].arguments += 1

    def _close(self, start: int) -> None:
        self._reduce_to_group()
        if not self._pending_operators:
            raise self.error("this parenthesis has no opening one; remove it, or add (", start)
        group = self._pending_operators.pop()
        self._depth -= 1
        if group.op == "(":
            term, _, _ = self._operands.pop()
            self._operands.append((term, group.position, start + 1))
            return
        count, expected_count = group.arguments + 1, FUNCTIONS[group.op]
        if count != expected_count and not (expected_count is None and count >= 2):
            expected_text = (
                "two or more arguments"
                if expected_count is None
                else _argument_count_text(expected_count)
            )
            raise self.error(f"{group.op}: expected {expected_text}, found {count}", group.position)
        arguments = self._operands[-count:]
        del self._operands[-count:]
        # min(a, b, c) is min(min(a, b), c)
        groups = [arguments]
        if expected_count is None:
            groups = [arguments[:2], *([a] for a in arguments[2:])]
        for members in groups:
            numbers = [m[0] for m in members]
            if members is not groups[0]:
                numbers.insert(0, len(self.terms) - 1)
            self._make(group.op, tuple(numbers), group.position, group.position, start + 1)
        self._operands.append((len(self.terms) - 1, group.position, start + 1))

    # --- making terms -------------------------------------------------------------------------

    def _push(self, term: Term, start: int, end: int) -> None:
        self.terms.append(term)
        self._operands.append((len(self.terms) - 1, start, end))

    def _number(self, token: str, start: int, end: int) -> Term:
        value = float(token)
        if math.isinf(value):
            raise self.error("this number is too large; the limit is about 1.8e308", start)
        if value == 0:
            if re.search("[1-9]", re.split("[eE]", token)[0]):
                raise self.error("this number is too small; the limit is about 4.9e-324", start)
            return Term("number", (), start, end, Fraction(0), 0.0)
        return Term("number", (), start, end, _limit_digits(Fraction(token), value), value)

    def _reduce(self) -> None:
        pending = self._pending_operators.pop()
        count = 1 if pending.op == "neg" else 2
        members = self._operands[-count:]
        del self._operands[-count:]
        start = pending.position if count == 1 else members[0][1]
        end = members[-1][2]
        self._make(pending.op, tuple(m[0] for m in members), pending.position, start, end)
        self._operands.append((len(self.terms) - 1, start, end))

    def _make(self, op: str, args: tuple[int, ...], mark: int, start: int, end: int) -> None:
        terms = [self.terms[i] for i in args]
        for number, term in enumerate(terms):
            wants_condition = op == "where" and number == 0
            if term.is_condition and not wants_condition:
                raise self.error(
                    "a comparison is not a number here; write where(condition, 1, 0)", term.start
                )
            if wants_condition and not term.is_condition:
                raise self.error(
                    "where(condition, a, b) begins with a comparison such as t < 1", term.start
                )
        if op == "div" and terms[1].constant == 0:
            raise self.error("division by zero", mark)
        exact, constant = self._fold(op, terms, mark)
        self.terms.append(Term(op, args, start, end, exact, constant))

    def _fold(self, op: str, terms: list[Term], mark: int) -> tuple[Fraction | None, float | None]:
        """Fold an operation on constants: (exact value if rational and short, double)."""
        values = [t.constant for t in terms if t.constant is not None]
        if len(values) < len(terms):
            return None, None
        value = float(OPERATION_FUNCTIONS[op](*values))
        if not math.isfinite(value):
            raise self.error(f"this {_OPERATION_NAMES.get(op, op)} has no finite real value", mark)
        exact = [t.exact for t in terms if t.exact is not None]
        if len(exact) < len(terms):
            return None, value
        if op == "pow":
            base, exponent = exact
            if exponent.denominator != 1 or abs(exponent) > 16:
                return None, value
            return _limit_digits(base ** int(exponent), value), value
        exact_value = (
            _limit_digits(Fraction(OPERATION_FUNCTIONS[op](*exact)), value)
            if op in _EXACT_OPERATIONS
            else None
        )
        return exact_value, value


_OPERATION_NAMES = {
    "pow": "power",
    "add": "sum",
    "sub": "difference",
    "mul": "product",
    "div": "quotient",
}


def _limit_digits(exact: Fraction, value: float) -> Fraction:
    """Exact number, or the nearest double where its fraction is too long."""
    bits = max(exact.numerator.bit_length(), exact.denominator.bit_length())
    return exact if bits <= _MAX_EXACT_BITS else Fraction(value)


def _argument_count_text(number: int) -> str:
    return "one argument" if number == 1 else f"{number} arguments"


def _did_you_mean(name: str) -> str:
    matches = difflib.get_close_matches(name[:MAX_NAME_LENGTH].lower(), FUNCTIONS, n=1, cutoff=0.5)
    if matches:
        return f"did you mean {matches[0]}?"
    return "the functions are " + ", ".join(FUNCTIONS)
