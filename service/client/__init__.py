"""A typed client of the HTTP interface: what it says, apart from how that travels."""

from service.client.calls import Refused
from service.client.clients import AsyncClient, Client

__all__ = ["AsyncClient", "Client", "Refused"]
