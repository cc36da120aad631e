"""Pages of lists: the `Link` header to the next one, beside `next_cursor`."""

from typing import Any
from urllib.parse import urlencode

from fastapi import Request

LIMIT = "Most entries of a page."
CURSOR = "`next_cursor` of the page before; absent: the first page."
# `headers` of an entry for `responses=`; the last page has none.
NEXT_PAGE: dict[str, Any] = {
    "Link": {"description": 'The next page, `rel="next"` (RFC 8288).', "schema": {"type": "string"}}
}


def next_page(request: Request, cursor: str | int | None) -> dict[str, str]:
    """Return the header that links the next page of a list; none after the last (`cursor` is None).

    The link is relative to the requested address, whatever a proxy puts in front of it.
    """
    if cursor is None:
        return {}
    kept = [(name, value) for name, value in request.query_params.multi_items() if name != "cursor"]
    return {"Link": f'<?{urlencode([*kept, ("cursor", cursor)])}>; rel="next"'}
