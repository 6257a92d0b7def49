"""Ctrl-C and the like: how a command hears that it shall end."""

from __future__ import annotations

import os
import signal
import threading

__all__ = ["hear_stops", "stop_asked"]

#: Longest time, seconds, that threads of a server may hold the process after Ctrl-C.
_LONGEST_END_S = 10.0
_asked = threading.Event()


class Stopped(KeyboardInterrupt):
    """Ctrl-C.

    Python ends by the signal itself, not by our exit code, where a plain KeyboardInterrupt passed
    through an ``exec`` of a string, as the making of a dataclass is, even if it was caught later.
    """


def stop_asked() -> bool:
    """Whether a stop was heard.

    Returns
    -------
    bool
        True where whatever is raised may come of it: some libraries make errors of their own of
        what passes through them.
    """
    return _asked.is_set()


def _stop(*_: object) -> None:
    _asked.set()
    raise Stopped


def _stop_surely(*_: object) -> None:
    timer = threading.Timer(_LONGEST_END_S, os._exit, (130,))
    timer.daemon = True
    timer.start()
    _stop()


def hear_stops(*, surely: bool = False) -> None:
    """Raise :class:`Stopped` in the first thread at Ctrl-C and at a polite kill.

    Parameters
    ----------
    surely : bool
        End the process some seconds later in any case: where a server has threads of its own, one
        of them may wait for a page, and what is raised inside a destructor is lost. Called where
        signals are heard already.
    """
    _asked.clear()
    stop = _stop_surely if surely else _stop
    heard = [_stop] if surely else [signal.default_int_handler, signal.SIG_DFL]
    for name in (signal.SIGTERM, signal.SIGINT):
        if signal.getsignal(name) in heard:  # else a shell has its children ignore it
            signal.signal(name, stop)
