"""Lists that come in pages: the address of the next one, beside `next_cursor`."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlencode

from fastapi import Request

# Of an entry for `responses=`; the last page has none.
NEXT_PAGE: dict[str, Any] = {
    "Link": {"description": 'The next page, `rel="next"` (RFC 8288).', "schema": {"type": "string"}}
}


def next_page(request: Request, cursor: str | int | None) -> dict[str, str]:
    """The header that names the next page of a list; none after the last (`cursor` is None).

    Relative to the address that was asked, whatever a proxy puts in front of it.
    """
    if cursor is None:
        return {}
    kept = [(name, value) for name, value in request.query_params.multi_items() if name != "cursor"]
    return {"Link": f'<?{urlencode([*kept, ("cursor", cursor)])}>; rel="next"'}
