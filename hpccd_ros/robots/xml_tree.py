# SPDX-License-Identifier: Apache-2.0
"""Untrusted XML as a tree whose elements know their line.

Only the text is read: a document type, the only place where XML defines entities and names other files, is rejected at
its first character. Size, depth and number of elements are limited.
"""

import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE, BOM_UTF32_BE, BOM_UTF32_LE, lookup
from dataclasses import dataclass, field
from xml.parsers import expat

from hpccd_ros.base.quoting import quoted, shortened
from hpccd_ros.robots.errors import RobotError

MOST_CHARACTERS = 16_000_000
MOST_ELEMENTS = 200_000
DEEPEST = 50

# Byte order marks, longest first: a mark of UTF-32 begins with one of UTF-16. Without a mark, the first character of
# XML shows UTF-16.
_MARKS = {
    BOM_UTF32_LE: "utf-32",
    BOM_UTF32_BE: "utf-32",
    BOM_UTF8: "utf-8-sig",
    BOM_UTF16_LE: "utf-16",
    BOM_UTF16_BE: "utf-16",
    b"<\0": "utf-16-le",
    b"\0<": "utf-16-be",
}
_DECLARED = re.compile(rb"""<\?xml[^>]*?\sencoding\s*=\s*["']([A-Za-z][A-Za-z0-9._-]{0,40})["']""")
# The character that replaces bytes which a decoder cannot decode.
_LOST = "\ufffd"


@dataclass(eq=False)
class Element:
    """``document``: its name in errors."""

    document: str
    tag: str
    attributes: dict[str, str]
    line: int
    children: list["Element"] = field(default_factory=list)

    def all(self, tag: str) -> list["Element"]:
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> "Element | None":
        """The child with this tag. Raises RobotError if there are several."""
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
        """Raises RobotError if there is none, or it is empty."""
        value = self.attributes.get(attribute, "")
        if not value.strip():
            raise self.error(f"has no attribute {attribute}; add it")
        if _LOST in value:
            raise self.error(f"has characters in {attribute} that were not sent as UTF-8; save the file as UTF-8")
        return value

    def error(self, problem: str) -> RobotError:
        name = self.attributes.get("name")
        called = f"<{shortened(self.tag)} name={quoted(name)}>" if name is not None else f"<{shortened(self.tag)}>"
        return RobotError(f"{self.document}, line {self.line}: {called} {problem}")


def decoded(data: bytes) -> str:
    """The text of an XML file, decoded according to its byte order mark, or else the encoding that it declares, or else
    as UTF-8. Raises RobotError with the remedy, without the name of the file."""
    encoding = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "")
    if not encoding:
        declared = _DECLARED.match(data.lstrip()[:1000])
        encoding = declared[1].decode() if declared else "utf-8"
    try:
        if re.match(r"utf-(16|32)", lookup(encoding).name) and b"\0" not in data:
            encoding = "utf-8"  # no zero bytes: saved again in another encoding
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        byte = f"byte 0x{data[error.start]:02x} in line {data[: error.start].count(10) + 1}"
        raise RobotError(
            f"is not {encoding.upper()} ({byte}); save it as UTF-8, or declare its encoding in the first line, as "
            '<?xml version="1.0" encoding="ISO-8859-1"?>'
        ) from error
    except (LookupError, UnicodeError) as error:
        raise RobotError(f"declares the encoding {quoted(encoding)}, which is unknown; save it as UTF-8") from error


def parse(text: str, document: str, root: str) -> Element:
    """The root, whose tag must be ``root``. Raises RobotError."""
    if len(text) > MOST_CHARACTERS:
        raise RobotError(f"{document}: has {len(text)} characters; at most {MOST_CHARACTERS} are allowed")
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
        # The text is already decoded: the encoding that the document declares no longer matters.
        self._parser = expat.ParserCreate("UTF-8")
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._reject_document_type

    def built(self, text: str) -> Element:
        try:
            self._parser.Parse(text.encode(), True)
        except expat.ExpatError as error:
            why = f"is not XML: {error}; export it again"
            if "\0" in text[:4]:  # every second byte of most UTF-16 texts
                why = "is UTF-16, which was sent as if it were UTF-8; save it as UTF-8"
            raise RobotError(f"{self._document}: {why}") from error
        except UnicodeEncodeError as error:
            raise RobotError(f"{self._document}: is not text: {error}; save it as UTF-8") from error
        assert self._root is not None  # expat requires an element
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._count += 1
        element = Element(self._document, tag, attributes, self._parser.CurrentLineNumber)
        if self._count > MOST_ELEMENTS:
            raise element.error(f"is one element too many; at most {MOST_ELEMENTS} are allowed")
        if len(self._open) >= DEEPEST:
            raise element.error(f"is nested more than {DEEPEST} elements deep; nest fewer")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, tag: str) -> None:
        self._open.pop()

    def _reject_document_type(self, *_: object) -> None:
        raise RobotError(
            f"{self._document}, line {self._parser.CurrentLineNumber}: has a document type (<!DOCTYPE>), which could "
            "define entities; remove it"
        )
