"""Safe XML reader: elements with line numbers, no entities, document types or external data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from ...argument_validation import parse_number
from ...errors import SceneError

#: Most nested elements; robots nest ten deep.
_MAX_DEPTH = 100


@dataclass(slots=True)
class Element:
    """XML element: tag, attributes, children, and its file and line for messages."""

    tag: str
    attributes: dict[str, str]
    where: str
    children: list[Element] = field(default_factory=list)

    def children_with_tag(self, tag: str) -> Iterator[Element]:
        """Children with this tag, in the order of the file."""
        return (child for child in self.children if child.tag == tag)

    def first_with_tag(self, tag: str) -> Element | None:
        """First child with this tag, or None."""
        return next(self.children_with_tag(tag), None)

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
            values = tuple(map(parse_number, text.replace(",", " ").split()))
        except ValueError:
            values = ()
        if len(values) != len(default) or not all(abs(x) < float("inf") for x in values):
            count_text = "a number" if len(default) == 1 else f"{len(default)} numbers"
            raise SceneError(
                f"{self.where}: <{self.tag}> {key}: expected {count_text} in {unit}, found "
                f"{text[:60]!r}"
            )
        return values


def parse_xml(content: bytes, where: str, deepest: int = _MAX_DEPTH) -> Element:
    """Parse an XML file: its outermost element.  Raises SceneError.

    `where` is the name of the file in messages, `deepest` the most nested elements.
    """
    text = content.lstrip()
    lines_above = content[: len(content) - len(text)].count(b"\n")
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    root_holder = Element("", {}, where)
    open_elements = [root_holder]

    def line() -> str:
        return f"{where}: line {lines_above + parser.CurrentLineNumber}"

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > deepest:
            raise SceneError(f"{where}: elements are nested more than {deepest} deep")
        element = Element(tag, attributes, line())
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def reject_declaration(*_: object) -> None:
        raise SceneError(
            f"{line()}: document types and entities are not supported; remove them from the file"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: open_elements.pop()
    parser.StartDoctypeDeclHandler = reject_declaration
    parser.EntityDeclHandler = reject_declaration
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        error_text = expat.ErrorString(error.code)
        raise SceneError(
            f"{where}: line {lines_above + error.lineno}: not valid XML: {error_text}"
        ) from None
    except (ValueError, LookupError) as error:  # includes unknown encodings
        raise SceneError(f"{where}: not valid XML: {error}") from None
    return root_holder.children[0]
