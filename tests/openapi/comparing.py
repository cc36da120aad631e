"""Whether clients that were written for one OpenAPI document can use a service that has another one.

What clients send must go on being taken: nothing of a request may be taken away, become required or be narrowed. What
they are answered must go on being what they read: nothing of an answer may be taken away, become optional or be another
type. Additions are no findings: routes, parameters and fields that may be left out, fields of answers, and words of
answers, which clients are told to pass on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Document = Mapping[str, Any]
Direction = Literal["request", "answer"]
METHODS = ("get", "put", "post", "delete", "patch")
# By each limit of a schema, which way it is narrowed.
SMALLEST = ("minimum", "exclusiveMinimum", "minLength", "minItems")
LARGEST = ("maximum", "exclusiveMaximum", "maxLength", "maxItems")


def findings(released: Document, now: Document) -> list[str]:
    """Each removal or tightening, in words, with where it is."""
    return list(dict.fromkeys(_Comparison(released, now).of_routes()))


@dataclass
class _Comparison:
    released: Document
    now: Document
    # Pairs of schemas by name that are being, or were, compared: they may contain themselves.
    compared: set[tuple[str, str, Direction]] = field(default_factory=set)

    def of_routes(self) -> Iterator[str]:
        for path, methods in self.released["paths"].items():
            for method in METHODS:
                if method in methods:
                    where = f"{method.upper()} {path}"
                    after = self.now["paths"].get(path, {}).get(method)
                    if after is None:
                        yield f"{where}: was removed"
                    else:
                        yield from self.of_operation(where, methods[method], after)
        for name, hook in self.released.get("webhooks", {}).items():
            after = self.now.get("webhooks", {}).get(name)
            if after is None:
                yield f"webhook {name}: was removed"
            else:
                # What the service sends there is read by clients.
                yield from self.of_bodies(f"webhook {name}", hook["post"], after["post"], "answer")

    def of_operation(self, where: str, before: Document, after: Document) -> Iterator[str]:
        known = {(one["in"], one["name"]): one for one in before.get("parameters", ())}
        others = {(one["in"], one["name"]): one for one in after.get("parameters", ())}
        for place, name in known.keys() - others.keys():
            yield f"{where}: the {place} parameter {name} was removed"
        for (place, name), parameter in others.items():
            old = known.get((place, name))
            if parameter.get("required") and not (old and old.get("required")):
                yield f"{where}: the {place} parameter {name} is required"
            if old:
                yield from self.of_schema(f"{where}: {name}", old["schema"], parameter["schema"], "request")
        if before.get("security") != after.get("security"):
            yield f"{where}: needs {after.get('security')}, not {before.get('security')}"
        yield from self.of_bodies(where, before, after, "request")
        for status, answer in before["responses"].items():
            if status not in after["responses"]:
                yield f"{where}: the answer {status} was removed"
                continue
            later = after["responses"][status]
            for header in answer.get("headers", {}).keys() - later.get("headers", {}).keys():
                yield f"{where}: the header {header} of the answer {status} was removed"
            yield from self.of_content(f"{where}: {status}", answer, later, "answer")

    def of_bodies(self, where: str, before: Document, after: Document, way: Direction) -> Iterator[str]:
        old, new = before.get("requestBody", {}), after.get("requestBody", {})
        if new.get("required") and not old.get("required"):
            yield f"{where}: a body is required"
        yield from self.of_content(f"{where}: body", old, new, way)

    def of_content(self, where: str, before: Document, after: Document, way: Direction) -> Iterator[str]:
        for media_type, content in before.get("content", {}).items():
            later = after.get("content", {}).get(media_type)
            if later is None:
                yield f"{where}: {media_type} was removed"
            elif "schema" in content:
                yield from self.of_schema(where, content["schema"], later.get("schema", {}), way)

    def of_schema(self, where: str, before: Document, after: Document, way: Direction) -> Iterator[str]:
        names = before.get("$ref", ""), after.get("$ref", "")
        if all(names):
            if (*names, way) in self.compared:
                return
            self.compared.add((*names, way))
        before, after = _resolved(self.released, before), _resolved(self.now, after)
        old, new = _alternatives(before), _alternatives(after)
        if len(old) > 1 or len(new) > 1:
            yield from self.of_alternatives(where, old, new, way)
            return
        yield from _types(where, before, after, way)
        if way == "request":
            yield from _narrowed(where, before, after)
        yield from self.of_members(where, before, after, way)
        if "items" in before:
            yield from self.of_schema(f"{where}[]", before["items"], after.get("items", {}), way)
        values = before.get("additionalProperties"), after.get("additionalProperties")
        if isinstance(values[0], Mapping) and isinstance(values[1], Mapping):
            yield from self.of_schema(f"{where}.*", values[0], values[1], way)
        elif way == "request" and values[1] is False and values[0] is not False and "properties" in before:
            yield f"{where}: members of any name are no longer taken"

    def of_alternatives(self, where: str, old: list[Document], new: list[Document], way: Direction) -> Iterator[str]:
        """Each that was taken must be taken still; each that is answered must be one that was, or a new object."""
        needed, known = (old, new) if way == "request" else (new, old)
        for one in needed:
            tried = [
                list(_Comparison(self.released, self.now, set(self.compared)).of_schema(where, *pair, way))
                for other in known
                for pair in [(one, other) if way == "request" else (other, one)]
            ]
            least = min(tried, key=len)
            resolved = _resolved(self.now, one) if way == "answer" else {}
            was_a_choice = sum(_resolved(self.released, other).get("type") == "object" for other in old) > 1
            if least and not (way == "answer" and resolved.get("type") == "object" and was_a_choice):
                yield from least

    def of_members(self, where: str, before: Document, after: Document, way: Direction) -> Iterator[str]:
        old, new = before.get("properties", {}), after.get("properties", {})
        required, now_required = set(before.get("required", ())), set(after.get("required", ()))
        for name in sorted(old.keys() - new.keys()):
            if way == "answer" or not after.get("additionalProperties", True):
                yield f"{where}.{name}: was removed"
        if way == "request":
            yield from (f"{where}.{name}: is required" for name in sorted(now_required - required))
        else:
            yield from (f"{where}.{name}: may be absent" for name in sorted((required - now_required) & new.keys()))
        for name in old.keys() & new.keys():
            yield from self.of_schema(f"{where}.{name}", old[name], new[name], way)


def _resolved(document: Document, schema: Document) -> Document:
    while "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    return schema


def _alternatives(schema: Document) -> list[Document]:
    choice = schema.get("anyOf") or schema.get("oneOf")
    return [one for way in choice for one in _alternatives(way)] if choice else [schema]


def _types(where: str, before: Document, after: Document, way: Direction) -> Iterator[str]:
    old, new = before.get("type"), after.get("type")
    wider, narrower = (new, old) if way == "request" else (old, new)
    if wider is not None and wider != narrower and (wider, narrower) != ("number", "integer"):
        yield f"{where}: is {new or 'anything'}, was {old or 'anything'}"


def _narrowed(where: str, before: Document, after: Document) -> Iterator[str]:
    words, now_words = _words(before), _words(after)
    if now_words is not None:
        gone = [str(word) for word in (words if words is not None else ["any other"]) if word not in now_words]
        if gone:
            yield f"{where}: {', '.join(gone)} is no longer taken"
    for limit in (*SMALLEST, *LARGEST):
        old, new = before.get(limit), after.get(limit)
        if new is not None and (old is None or (new > old if limit in SMALLEST else new < old)):
            yield f"{where}: {limit} is {new}, was {'none' if old is None else old}"
    for rule in ("pattern", "format", "multipleOf"):
        if after.get(rule) is not None and after.get(rule) != before.get(rule):
            yield f"{where}: {rule} is {after[rule]}, was {before.get(rule, 'none')}"


def _words(schema: Document) -> list[Any] | None:
    return [schema["const"]] if "const" in schema else schema.get("enum")
