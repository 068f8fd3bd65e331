"""Who may speak to the page that this machine serves: its own tabs, and nobody for ever.

A browser lets any site that a user visits send requests here, and says in ``Origin`` which one."""

import asyncio
from typing import Any
from urllib.parse import urlsplit

from uvicorn.protocols.http.h11_impl import H11Protocol

HEADERS = 10.0
"""Seconds that a client has for the headers of its first request."""


class OwnOrigin:
    """Refuses what another site's page asks for: HTTP with 403, a websocket before it is opened."""

    def __init__(self, app: Any) -> None:
        self.app = app

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Serve a request of ASGI."""
        headers = dict(scope.get("headers", ()))
        origin = headers.get(b"origin", b"").decode("latin-1")
        if not origin or urlsplit(origin).netloc == headers.get(b"host", b"").decode("latin-1"):
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()  # that it wants to connect
            await send({"type": "websocket.close", "code": 1008})
        else:
            await send({"type": "http.response.start", "status": 403, "headers": []})
            await send({"type": "http.response.body", "body": b"another site's page\n"})


class Prompt(H11Protocol):
    """A connection that is closed if no request has come for `HEADERS` seconds."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait."""
        super().connection_made(transport)
        self.loop.call_later(HEADERS, self._close_unless_asked)

    def _close_unless_asked(self) -> None:
        if self.scope is None and not self.transport.is_closing():
            self.transport.close()
