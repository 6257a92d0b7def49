"""The gate of the studio's page: who may ask, and for what.

The page is served to this machine alone, but every program on it, and every page in its browser,
can reach a port of it. So a request passes only if its ``Host`` is this machine (a page elsewhere
whose name is bound anew to 127.0.0.1 says another), its ``Origin``, where it has one, is this page
(a page elsewhere says its own), and it brings the token of this run: once in the address that the
studio prints, after that in a cookie.
"""

from __future__ import annotations

import contextlib
import io
import secrets
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from fabfold.errors import InputError

if TYPE_CHECKING:
    import viser
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

__all__ = ["Gate", "quiet_stop", "start_server"]

#: The page may load what it was served, what it makes itself, and nothing from elsewhere.
_POLICY = (
    "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'; "
    "connect-src 'self' data: blob: ws://127.0.0.1:{port} ws://localhost:{port}; "
    "frame-ancestors 'none'"
)


@dataclass
class Gate:
    """What a request must bring.

    Attributes
    ----------
    token : str
        Secret of this run.
    port : int
        Where the page is served; known once the server listens.
    """

    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    port: int = 0

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://127.0.0.1:{self.port}/?token={self.token}"

    def refusal(self, path: str, headers: dict[str, str]) -> str:
        """Why a request may not pass; empty where it may.

        Parameters
        ----------
        path : str
            With its query.
        headers : dict of str to str
            By names in small letters.
        """
        here = {f"127.0.0.1:{self.port}", f"localhost:{self.port}"}
        if headers.get("host", "") not in here:
            return "this page is served to this machine only"
        origin = headers.get("origin", "")
        if origin and origin not in {f"http://{host}" for host in here}:
            return "pages from elsewhere may not use the studio"
        given = [self._cookie(headers.get("cookie", "")), self._query(path)]
        if not any(secrets.compare_digest(text.encode(), self.token.encode()) for text in given):
            return "open the address that fabfold studio printed: it has the key to this page"
        return ""

    def _cookie(self, text: str) -> str:
        try:
            found = SimpleCookie(text).get(self._name)
        except CookieError:
            return ""
        return "" if found is None else found.value

    @staticmethod
    def _query(path: str) -> str:
        return parse_qs(urlsplit(path).query).get("token", [""])[0]

    @property
    def _name(self) -> str:
        # Cookies of 127.0.0.1 are shared by all its ports.
        return f"fabfold-{self.port}"

    def answer_headers(self) -> dict[str, str]:
        """Headers of each answer that passes."""
        return {
            "Set-Cookie": f"{self._name}={self.token}; HttpOnly; SameSite=Strict; Path=/",
            "Content-Security-Policy": _POLICY.format(port=self.port),
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Cache-Control": "no-store",
        }


def start_server(gate: Gate, port: int) -> viser.ViserServer:
    """Serve viser's page behind a gate.

    Parameters
    ----------
    gate : Gate
        Its port is set to the one that was taken.
    port : int
        Wanted; 0 takes a free one.

    Returns
    -------
    viser.ViserServer
        Listening on 127.0.0.1.

    Raises
    ------
    InputError
        If viser is not installed.
    """
    try:
        import viser
    except ImportError:
        raise InputError(
            "the studio needs viser: pip install 'fabfold[studio]', or pip install viser"
        ) from None
    # viser greets on the standard output.
    with _guarded(gate), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer("127.0.0.1", port, label="fabfold", verbose=False)
        gate.port = server.get_port()
    return server


def quiet_stop(server: viser.ViserServer) -> None:
    """Stop a server without its own words on the screen."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


Process = Callable[["ServerConnection", "Request"], Any]


@contextlib.contextmanager
def _guarded(gate: Gate) -> Iterator[None]:
    """While it is open, a websockets server that is started asks the gate first.

    viser has no setting for this: it hands its own `process_request` to
    ``websockets.asyncio.server.serve``, which is looked up when its server starts.
    """
    import websockets.asyncio.server as module

    serve = module.serve

    def start(*args: Any, process_request: Process | None = None, **options: Any) -> Any:
        return serve(*args, process_request=_behind(gate, process_request), **options)

    module.serve = start  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        module.serve = serve  # type: ignore[misc]


def _behind(
    gate: Gate, inner: Process | None
) -> Callable[[ServerConnection, Request], Awaitable[Response | None]]:
    """Answer of a request: refused, or what `inner` says."""

    async def process(connection: ServerConnection, request: Request) -> Response | None:
        headers = {name.lower(): value for name, value in request.headers.raw_items()}
        if why := gate.refusal(request.path, headers):
            return connection.respond(403, f"fabfold studio: {why}\n")
        # The page is the same whatever the query.
        request.path = urlsplit(request.path).path
        response: Any = inner(connection, request) if inner is not None else None
        if hasattr(response, "__await__"):
            response = await response
        if response is not None:
            for name, value in gate.answer_headers().items():
                if name in response.headers:
                    del response.headers[name]
                response.headers[name] = value
        answer: Response | None = response
        return answer

    return process
