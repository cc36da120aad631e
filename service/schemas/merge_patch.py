"""JSON merge patches (RFC 7396): a value replaces, null removes, everything else stays.

One addition: a list of things that have ids may be patched by an object of those ids. By the RFC alone a camera's
source could only be changed by sending all cameras, with the poses that they happened to have when they were read.
"""

from typing import Any

MEDIA_TYPE = "application/merge-patch+json"
# Deeper than any document of this interface: below, the patch replaces the target as a whole.
DEEPEST = 16


def apply_merge_patch(target: Any, patch: Any, depth: int = 0) -> Any:
    """Return a document with a patch applied; neither is modified."""
    if not isinstance(patch, dict) or depth > DEEPEST:
        return patch
    if isinstance(target, list) and all(isinstance(one, dict) and "id" in one for one in target):
        by_id = apply_merge_patch({one["id"]: one for one in target}, patch, depth)
        return [{"id": name} | one if isinstance(one, dict) else one for name, one in by_id.items()]
    after = dict(target) if isinstance(target, dict) else {}
    for name, value in patch.items():
        if value is None:
            after.pop(name, None)
        else:
            after[name] = apply_merge_patch(after.get(name), value, depth + 1)
    return after
