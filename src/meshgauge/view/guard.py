"""Who may use the web application: whoever knows its address, which is secret, and on Linux only the same user.

It listens on loopback alone. Others on the machine can connect there too, so its pages and its socket are below a
path of random letters; and where the system tells whose a connection is, those of others are refused.
"""

from __future__ import annotations

import atexit
import html
import os
import secrets
import shutil
import tempfile
from collections.abc import Awaitable, Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

HOST = "127.0.0.1"

TABLE = Path("/proc/net/tcp")
"""Linux's list of connections, with the user of each."""

HEADERS = {
    "Referrer-Policy": "no-referrer",  # the path is a secret
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
    # Vue compiles its templates in the browser, hence eval; nothing comes from elsewhere.
    "Content-Security-Policy": "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; frame-ancestors 'none'",
}

LOOPBACK = ("http://127.0.0.1:*", "http://localhost:*")
"""Pages that may have the application in a frame, where it is asked for: those of this machine, as notebooks are."""


def headers(frames: Iterable[str] = ()) -> dict[str, str]:
    """What is said with every answer; ``frames`` are those whose pages may have ours in a frame, by default nobody."""
    if not (allowed := " ".join(frames)):
        return HEADERS
    policy = HEADERS["Content-Security-Policy"].replace("frame-ancestors 'none'", f"frame-ancestors {allowed}")
    others = {name: value for name, value in HEADERS.items() if name != "X-Frame-Options"}
    return {**others, "Content-Security-Policy": policy}


def secret() -> str:
    """A path that cannot be guessed: 192 bits, in small letters, as trame's page asks for it."""
    return secrets.token_hex(24)


def owner(table: str, peer_port: int, port: int) -> int | None:
    """User id of the other end of a loopback connection; None if the table does not have it.

    Parameters
    ----------
    table
        Text of ``/proc/net/tcp``: addresses are hexadecimal, that of the machine's byte order first.
    peer_port, port
        Of the other end, and of this one.
    """
    for line in table.splitlines()[1:]:
        columns = line.split()
        if len(columns) < 8:
            continue
        local, remote = columns[1].rpartition(":")[2], columns[2].rpartition(":")[2]
        if (int(local, 16), int(remote, 16)) == (peer_port, port):
            return int(columns[7])
    return None


def is_allowed(peer: tuple[str, int] | None, port: int) -> bool:
    """Whether a connection comes from this machine, and from this user or root as far as the system tells."""
    if peer is None or peer[0] != HOST:
        return False
    if not hasattr(os, "getuid"):
        return True
    try:
        user = owner(TABLE.read_text(encoding="ascii"), peer[1], port)
    except OSError:
        return True  # no such table: not Linux
    return user is None or user in (0, os.getuid())


def is_addressed(headers: Mapping[str, str], port: int) -> bool:
    """Whether a request means this server and comes from its own page, not from one that a name was made to lead here.

    A page of elsewhere may have its own name resolved to this machine (DNS rebinding): the browser then asks with that
    name as the host. It may also open a socket: the browser then tells the origin.
    """
    places = {f"{name}:{port}" for name in (HOST, "localhost")}
    origin = headers.get("Origin")
    return headers.get("Host") in places and (origin is None or origin in {f"http://{place}" for place in places})


def only_controls(protocol: Any, names: Iterable[str]) -> None:
    """Have trame's protocol take from browsers changes of these values only: all others are but shown there."""
    from wslink import register as export  # type: ignore[import-untyped]

    allowed = frozenset(names)
    kind: Any = type(protocol)

    class Guarded(kind):  # type: ignore[misc]  # a class that is known here only
        @export("trame.state.update")  # type: ignore[untyped-decorator]
        def update_state(self, changes: list[dict[str, Any]]) -> None:
            super().update_state([change for change in changes if change.get("key") in allowed])

    protocol.__class__ = Guarded  # which wslink asks for its methods


def redirect_page(address: str) -> Path:
    """A page that only this user can read and that leads to an address, so that no argument of a process tells it."""
    path = Path(tempfile.mkdtemp(prefix="meshgauge-view-"), "index.html")
    content = (
        f'<!doctype html><meta http-equiv="refresh" content="0; url={html.escape(address)}"><title>meshgauge</title>'
    )
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
        file.write(content)
    atexit.register(shutil.rmtree, path.parent, ignore_errors=True)
    return path


def middleware(path: str) -> Any:
    """For aiohttp: refuses who is not allowed, and tells the page below a secret path where its socket is.

    trame's page first asks a launcher, which other servers have; answered, it need not guess.
    """
    from aiohttp import web

    @web.middleware
    async def guarded(request: Any, handler: Callable[[Any], Awaitable[Any]]) -> Any:
        transport = request.transport
        peer, here = transport.get_extra_info("peername"), transport.get_extra_info("sockname")
        if not is_allowed(tuple(peer[:2]) if peer else None, here[1]):
            raise web.HTTPForbidden(text="meshgauge view: another user's")
        if not is_addressed(request.headers, here[1]):
            raise web.HTTPForbidden(text="meshgauge view: asked by another name, or by another page")
        if (request.method, request.path) == ("POST", f"/{path}/paraview/"):
            return web.json_response({"sessionURL": f"ws://{request.headers['Host']}/{path}/ws"})
        return await handler(request)

    return guarded
