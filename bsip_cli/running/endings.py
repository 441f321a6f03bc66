"""How a run is ended from outside: HUP, INT and TERM become one exception, which tidies up."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

ENDING = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)
_raised: list[int] = []
_SHELL = 128  # shells add it to a signal's number for the exit code


class EndedError(BaseException):
    """A signal asks the process to end; not an ``Exception``, so that nothing takes it for one."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number

    @property
    def exit_code(self) -> int:
        return _SHELL + self.number

    def __str__(self) -> str:
        name = signal.Signals(self.number).name
        return f"ended by {name}; what is finished stays, and the next run goes on from there"


def raise_when_ended(once: bool = False) -> None:
    """From now on these signals raise `EndedError`; those that are ignored (nohup) stay so.

    once : those that come later are ignored, for a process that another one will kill.
    """
    for number in ENDING:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _raise_once if once else _raise)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)


def _raise(number: int, _frame: object) -> None:
    _raised.append(number)
    raise EndedError(number)


def _raise_once(number: int, frame: object) -> None:
    ignore_endings()
    _raise(number, frame)


def end_if_asked() -> None:
    """Raise again what code of others has caught, or made an error of its own (pydantic does)."""
    if _raised:
        raise EndedError(_raised[0])


@contextmanager
def endings_kept() -> Iterator[None]:
    """Whatever becomes of the exception inside, an ending is one afterwards."""
    try:
        yield
    except Exception:
        end_if_asked()
        raise
    end_if_asked()


def ignore_endings() -> None:
    """From now on nothing is raised, for a process that is about to end."""
    for number in ENDING:  # with SIG_IGN, Python would complain of one that has just come
        signal.signal(number, _pass_over)


def _pass_over(_number: int, _frame: object) -> None:
    return


def signal_in(exit_code: int | None) -> int | None:
    """The signal that ended a process, if one of these did: by itself or as an exit code."""
    code = exit_code or 0
    number = -code if code < 0 else code - _SHELL
    return number if number in ENDING else None


@contextmanager
def endings_wait() -> Iterator[None]:
    """Inside, the signals wait until the end; processes started there begin with them waiting."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
