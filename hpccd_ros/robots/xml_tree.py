# SPDX-License-Identifier: Apache-2.0
"""XML that strangers sent, as a tree whose elements know their line.

Nothing but the text is read: a document type, the only place where XML defines entities and names other files, is
refused at its first character. Size, depth and number of elements are bounded.
"""

from dataclasses import dataclass, field
from xml.parsers import expat

from hpccd_ros.base.quoting import quoted, shortened
from hpccd_ros.robots.errors import RobotError

MOST_CHARACTERS = 16_000_000
MOST_ELEMENTS = 200_000
DEEPEST = 50


@dataclass(eq=False)
class Element:
    """``document``: what the whole is called in errors."""

    document: str
    tag: str
    attributes: dict[str, str]
    line: int
    children: list["Element"] = field(default_factory=list)

    def all(self, tag: str) -> list["Element"]:
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> "Element | None":
        """The child of this tag. Raises RobotError: there are several."""
        found = self.all(tag)
        if len(found) > 1:
            raise found[1].error(f"is the second in <{self.tag}> in line {self.line}; one is allowed")
        return found[0] if found else None

    def needed(self, tag: str) -> "Element":
        child = self.one(tag)
        if child is None:
            raise self.error(f"has no <{tag}>; add one")
        return child

    def text(self, attribute: str) -> str:
        """Raises RobotError: there is none, or it is empty."""
        value = self.attributes.get(attribute, "")
        if not value.strip():
            raise self.error(f"needs the attribute {attribute}")
        return value

    def error(self, problem: str) -> RobotError:
        name = self.attributes.get("name")
        called = f"<{shortened(self.tag)} name={quoted(name)}>" if name is not None else f"<{shortened(self.tag)}>"
        return RobotError(f"{self.document}, line {self.line}: {called} {problem}")


def parse(text: str, document: str, root: str) -> Element:
    """The root, whose tag must be ``root``. Raises RobotError."""
    if len(text) > MOST_CHARACTERS:
        raise RobotError(f"{document}: has {len(text)} characters; {MOST_CHARACTERS} are allowed")
    top = _Builder(document).built(text)
    if top.tag != root:
        raise top.error(f"is the outermost element; it must be <{root}>")
    return top


class _Builder:
    def __init__(self, document: str) -> None:
        self._document = document
        self._open: list[Element] = []
        self._root: Element | None = None
        self._count = 0
        # The text is decoded already: what the document says of its encoding no longer matters.
        self._parser = expat.ParserCreate("UTF-8")
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._refuse_document_type

    def built(self, text: str) -> Element:
        try:
            self._parser.Parse(text.encode(), True)
        except expat.ExpatError as error:
            raise RobotError(f"{self._document}: is no XML: {error}; export it anew") from error
        except UnicodeEncodeError as error:
            raise RobotError(f"{self._document}: is no text: {error}; save it as UTF-8") from error
        assert self._root is not None  # expat demands an element
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._count += 1
        element = Element(self._document, tag, attributes, self._parser.CurrentLineNumber)
        if self._count > MOST_ELEMENTS:
            raise element.error(f"is one element too many; {MOST_ELEMENTS} are allowed")
        if len(self._open) >= DEEPEST:
            raise element.error(f"is more than {DEEPEST} elements deep; that is too deep")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, tag: str) -> None:
        self._open.pop()

    def _refuse_document_type(self, *_: object) -> None:
        raise RobotError(
            f"{self._document}, line {self._parser.CurrentLineNumber}: has a document type (<!DOCTYPE>), which could "
            "define entities; remove it"
        )
