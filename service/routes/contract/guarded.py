"""Routes that check the scope that their documentation names."""

from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from service.api.body_limit import is_form
from service.api.problems import not_json
from service.routes.contract import restricted
from service.routes.contract.attribution import caller_key
from service.routes.contract.documented import KEY_SCHEME
from service.schemas.names import Scope


class Guarded(APIRoute):
    """Route with `openapi_extra=needs_scope(...)`: its security requirement is both documented and checked.

    It is checked before the body is read: FastAPI reads a body before it calls any dependency. A key for some venues is
    then refused unless the request is about one of them.
    """

    def __init__(self, path: str, endpoint: Callable[..., Any], **rest: Any) -> None:
        security = (rest.get("openapi_extra") or {}).get("security")
        if security is None:
            raise TypeError(f"{path} must say who may call it: openapi_extra=needs_scope(...) or =FOR_ALL")
        self.needed: Scope | None = security[0][KEY_SCHEME][0] if security else None
        super().__init__(path, endpoint, **rest)

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the handler of the route behind the checks."""
        handle, needed = super().get_route_handler(), self.needed
        takes_document = self.body_field is not None
        lists = restricted.is_list(self)
        if needed is None:
            return handle

        async def guarded(request: Request) -> Response:
            request.state.key = key = await request.app.state.context.authenticator.admit(request, needed)
            caller_key.set(key)
            if key is not None:
                request.state.origin = replace(request.state.origin, asked_by=f"key {key.name}")
                await restricted.check(request, key, lists=lists)
            # Forms may be large, and here one would be held in memory only to be refused.
            if takes_document and is_form(request):
                raise not_json(request)
            return await handle(request)

        return guarded
