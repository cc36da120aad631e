"""Parsed files of strangers: JSON, YAML, TOML, XML, Python literals as trees, and lines or bytes of COLMAP.

No parser here builds objects: YAML is built from its events without tags and aliases, XML with entities is refused, a
Python literal is no program. Size and depth are limited before anything is built.
"""

import ast
import io
import json
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal
from xml.etree import ElementTree

import yaml

from service.formats.nodes import FileRefusedError, Node

# A calibration of a hundred cameras takes 100 kB; OpenCV and mrcal may add all corners of their boards.
MOST_BYTES = 8 * 2**20
# COLMAP lists the points of each picture.
MOST_BYTES_OF_COLMAP = 256 * 2**20
# Deepest calibration of all formats: OpenTrackIO's, with 6.
DEEPEST = 32
# What mrcal keeps of its board pictures, in base 85.
BOARD_DATA = re.compile(r"""["']optimization_inputs["']\s*:\s*b?(["']).*?\1\s*,?""", re.DOTALL)
COLMAP_LINE = re.compile(r"\s*\d+\s+(?:[A-Z_]+\s+\d+\s+\d+|\S+\s+\S+\s+\S+\s+\S+\s+\S+\s+\S+\s+\S+\s+\d+\s+\S)")
TOML_LINE = re.compile(r"\s*(?:\[[^\[\],]+\]\s*(?:#.*)?$|[\w.\"-]+\s*=)")
Kind = Literal["json", "yaml", "toml", "xml", "python", "colmap", "binary"]


@dataclass(frozen=True)
class ParsedFile:
    """A file by its name, the kind of its content, and the content: a tree, or text or bytes of COLMAP."""

    name: str
    kind: Kind
    content: Any

    @property
    def top(self) -> Node:
        """The tree of the file."""
        return Node(self.name, "", self.content)


def parse_file(name: str, data: bytes) -> ParsedFile:
    """Return a parsed file, by its content alone. Raises `FileRefusedError`."""
    if len(data) > MOST_BYTES_OF_COLMAP:
        raise FileRefusedError(name, "", f"at most {MOST_BYTES_OF_COLMAP} bytes", f"{len(data)}")
    if b"\0" in data[:4096]:
        return ParsedFile(name, "binary", data)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileRefusedError(name, f"byte {error.start}", "text in UTF-8", repr(data[error.start])) from None
    kind = _kind_of(text)
    if kind == "colmap":
        return ParsedFile(name, kind, text)
    if kind == "python":
        text = BOARD_DATA.sub("", text)
    if len(text) > MOST_BYTES:
        raise FileRefusedError(name, "", f"at most {MOST_BYTES} bytes", f"{len(text)}")
    if kind != "xml":
        _limit_depth(name, text)
    try:
        content = PARSERS[kind](text)
    except (ValueError, SyntaxError, yaml.YAMLError, ElementTree.ParseError, RecursionError, MemoryError) as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise FileRefusedError(name, "", f"valid {kind.upper() if kind != 'python' else '.cameramodel'}", why) from None
    return ParsedFile(name, kind, content)


def _kind_of(text: str) -> Kind:
    first = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")
    match first.lstrip()[:1]:
        case "<":
            return "xml"
        case "{":
            return "python" if re.search(r"""["']lensmodel["']\s*:""", text) else "json"
    if COLMAP_LINE.match(first):
        return "colmap"
    return "toml" if TOML_LINE.match(first) else "yaml"


def _limit_depth(name: str, text: str) -> None:
    """Refuse brackets nested too deeply: parsers of JSON, TOML and Python go down by recursion."""
    depth = 0
    for bracket in re.finditer(r"[\[\]{}()]", text):
        depth += 1 if bracket[0] in "[{(" else -1
        if depth > DEEPEST:
            line = text.count("\n", 0, bracket.start()) + 1
            raise FileRefusedError(name, f"line {line}", f"at most {DEEPEST} brackets within each other", "more")


def _parse_yaml(text: str) -> Any:
    """Return the tree of YAML's events; the loaders of the library build objects and follow aliases."""
    # OpenCV's own first line, `%YAML:1.0`, is no YAML.
    text = re.sub(r"\A%YAML[^\n]*\n", "", text)
    root: list[Any] = []
    stack: list[Any] = [root]
    keys: list[Any] = [None]

    def put(value: Any) -> None:
        if isinstance(stack[-1], list):
            stack[-1].append(value)
        elif keys[-1] is None:
            if not isinstance(value, str | int | float):
                raise ValueError("a key that is no text")
            keys[-1] = str(value)
        else:
            stack[-1][keys[-1]], keys[-1] = value, None

    for event in yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
        match event:
            case yaml.AliasEvent():
                raise ValueError("an alias (*), which calibrations do without")
            case yaml.ScalarEvent():
                put(event.value if event.style in ("'", '"') else _scalar(event.value))
            case yaml.MappingStartEvent() | yaml.SequenceStartEvent():
                value: Any = {} if isinstance(event, yaml.MappingStartEvent) else []
                put(value)
                stack.append(value)
                keys.append(None)
                if len(stack) > DEEPEST:
                    raise ValueError(f"more than {DEEPEST} levels")
            case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                stack.pop()
                keys.pop()
    if len(root) != 1:
        raise ValueError(f"{len(root)} documents" if root else "nothing but comments")
    return root[0]


def _scalar(text: str) -> Any:
    """Return what a text without quotes means: a number, true or false, null, or the text."""
    words = {"true": True, "false": False, "null": None, "~": None, "": None}
    if text.lower() in words:
        return words[text.lower()]
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text


def _parse_xml(text: str) -> Any:
    """Return the tree of OpenCV's XML: names of elements as keys, numbers in a row as a list."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("a DOCTYPE or entities, which calibrations do without")
    root: dict[str, Any] = {}
    stack: list[dict[str, Any]] = [root]
    for moment, element in ElementTree.iterparse(io.StringIO(text), ("start", "end")):
        if moment == "start":
            stack.append({})
            if len(stack) > DEEPEST:
                raise ValueError(f"more than {DEEPEST} levels")
        else:
            children = stack.pop()
            words = [_scalar(word) for word in (element.text or "").split()]
            stack[-1][str(element.tag)] = children or (words[0] if len(words) == 1 else words)
    if "opencv_storage" not in root:
        raise ValueError(f"<{next(iter(root))}> in place of <opencv_storage>")
    return root["opencv_storage"]


PARSERS: dict[Kind, Callable[[str], Any]] = {
    "json": json.loads,
    "yaml": _parse_yaml,
    "toml": tomllib.loads,
    "xml": _parse_xml,
    "python": ast.literal_eval,
}
