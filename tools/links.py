"""Links of a page of the repository, where it is read outside of the repository."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection

LINK = re.compile(r"(!?)(\[[^]]*\]\()(?!https?:|#)([^)#]+)")


def with_absolute_links(text: str, folder: str, repository: str, revision: str, near: Collection[str] = ()) -> str:
    """Return the text of a page of `folder` with links into the repository at its address.

    Links to the files of `near` stay as they are: they lie beside the page there, too.
    """

    def absolute(link: re.Match[str]) -> str:
        file = posixpath.normpath(posixpath.join(folder, link[3]))
        address = link[3] if file in near else f"{repository}/{'raw' if link[1] else 'blob'}/{revision}/{file}"
        return f"{link[1]}{link[2]}{address}"

    return LINK.sub(absolute, text)
