"""Who may speak to the page that this machine serves: its own tabs alone.

A browser lets any site that a user visits send requests here, and says in ``Origin`` which one."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlsplit


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
