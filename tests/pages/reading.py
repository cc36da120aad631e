"""Pages as their HTML, for what needs no browser."""

import html
import re

# What browsers send when somebody follows a link.
CHROME = "text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,image/webp,*/*;q=0.8"


def shown_at(service, path, status=200):
    """The HTML of a page as a browser asks for it."""
    answer = service.http.get(path, headers={"Accept": CHROME})
    assert answer.status_code == status
    return answer.text


def words_of(shown):
    """The text of a piece of HTML."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", "", shown)).split())
