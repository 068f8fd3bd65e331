"""Signals that end a program: nothing else is imported before they are heard."""

import signal

_NAMES = "SIGINT", "SIGTERM", "SIGHUP", "SIGXCPU"
"""Ctrl-C, what clusters send, a terminal that was closed, processor time that is used up."""
SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
