"""XML with the line of every element, without entities, document types or anything from outside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from ...arguments import number_in
from ...errors import SceneError

#: Elements inside each other; robots nest ten deep.
_DEEPEST = 100


@dataclass(slots=True)
class Element:
    """An element: its tag, attributes, what is inside, and where it begins."""

    tag: str
    attributes: dict[str, str]
    where: str
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """What is inside and has this tag, in the order of the file."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """The first of them, None where there is none."""
        return next(self.all(tag), None)

    def text(self, key: str) -> str:
        """An attribute that must be there.  Raises SceneError."""
        value = self.attributes.get(key, "").strip()
        if not value:
            raise SceneError(f"{self.where}: <{self.tag}> has no {key}; write {key}=...")
        return value

    def number(self, key: str, default: float, unit: str) -> float:
        """An attribute that is a finite number.  Raises SceneError."""
        return self.numbers(key, (default,), unit)[0]

    def numbers(self, key: str, default: tuple[float, ...], unit: str) -> tuple[float, ...]:
        """As many finite numbers as `default` has, with blanks between.  Raises SceneError."""
        text = self.attributes.get(key)
        if text is None:
            return default
        try:
            found = tuple(map(number_in, text.replace(",", " ").split()))
        except ValueError:
            found = ()
        if len(found) != len(default) or not all(abs(x) < float("inf") for x in found):
            many = "a number" if len(default) == 1 else f"{len(default)} numbers"
            raise SceneError(
                f"{self.where}: <{self.tag}> {key}: expected {many} in {unit}, found {text[:60]!r}"
            )
        return found


def parsed(content: bytes, where: str, deepest: int = _DEEPEST) -> Element:
    """The outermost element of a file whose name is `where`, with at most `deepest` inside each
    other.  Raises SceneError."""
    text = content.lstrip()
    above = content[: len(content) - len(text)].count(b"\n")
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    outside = Element("", {}, where)
    open_ = [outside]

    def line() -> str:
        return f"{where}: line {above + parser.CurrentLineNumber}"

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_) > deepest:
            raise SceneError(f"{where}: elements are nested more than {deepest} deep")
        one = Element(tag, attributes, line())
        open_[-1].children.append(one)
        open_.append(one)

    def refused(*_: object) -> None:
        raise SceneError(
            f"{line()}: a document type or an entity is not read; take it out of the file"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: open_.pop()
    parser.StartDoctypeDeclHandler = refused
    parser.EntityDeclHandler = refused
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        raise SceneError(f"{where}: line {above + error.lineno}: not valid XML: {what}") from None
    except (ValueError, LookupError) as error:  # of an encoding that nobody knows, too
        raise SceneError(f"{where}: not valid XML: {error}") from None
    return outside.children[0]
