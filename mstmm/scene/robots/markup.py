"""Safe XML reader: elements with line numbers, no entities, document types or external data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from ...arguments import number_in
from ...errors import SceneError

#: Most nested elements; robots nest ten deep.
_DEEPEST = 100


@dataclass(slots=True)
class Element:
    """XML element: tag, attributes, children, and its file and line for messages."""

    tag: str
    attributes: dict[str, str]
    where: str
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """Children with this tag, in the order of the file."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """First child with this tag, or None."""
        return next(self.all(tag), None)

    def text(self, key: str) -> str:
        """Value of a required attribute.  Raises SceneError."""
        value = self.attributes.get(key, "").strip()
        if not value:
            raise SceneError(f"{self.where}: <{self.tag}> has no {key}; add {key}=...")
        return value

    def number(self, key: str, default: float, unit: str) -> float:
        """Value of an attribute as a finite number.  Raises SceneError."""
        return self.numbers(key, (default,), unit)[0]

    def numbers(self, key: str, default: tuple[float, ...], unit: str) -> tuple[float, ...]:
        """Value of an attribute as len(default) finite numbers.  Raises SceneError."""
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
    """Parse an XML file: its outermost element.  Raises SceneError.

    `where` is the name of the file in messages, `deepest` the most nested elements.
    """
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
            f"{line()}: document types and entities are not supported; remove them from the file"
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
    except (ValueError, LookupError) as error:  # includes unknown encodings
        raise SceneError(f"{where}: not valid XML: {error}") from None
    return outside.children[0]
