"""Processes that work on tasks one after the other, and how all of them end.

HUP, INT and TERM become one exception, which tidies up; workers end with the process that started
them.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Generic, NoReturn, TypeVar

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

    def answer(number: int, _frame: object) -> None:
        if once:
            ignore_endings()
        _raised.append(number)
        raise EndedError(number)

    for number in ENDING:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, answer)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)


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
        signal.signal(number, lambda *_: None)


def leave(exit_code: int) -> NoReturn:
    """End with this code even if a signal comes while Python ends, which drops its handlers."""
    ignore_endings()
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)
    sys.exit(exit_code)


@contextmanager
def endings_wait() -> Iterator[None]:
    """Inside, the signals wait until the end; processes started there begin with them waiting."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- workers ----------------------------------------------------------------------------------

_SPAWN = multiprocessing.get_context("spawn")
_TO_END_S = 2.0  # for a worker that was asked to end; then it is killed

Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass
class _Worker(Generic[Task]):
    process: BaseProcess
    pipe: Connection
    task: Task | None = None


@dataclass(frozen=True)
class Died(Generic[Task]):
    """A worker came to its end in the middle of a task."""

    task: Task
    exit_code: int | None


def work_on(
    tasks: Iterable[Task],
    work: Callable[[Task], Iterable[Result]],
    jobs: int,
    tidy: Callable[[Task], None],
) -> Iterator[Result | Died[Task]]:
    """The results of ``work`` on each task as they come, from so many processes at once.

    work : a function of a module, since it is found by its name in another process.
    tidy : what is to be done for a task whose worker was killed in its middle.

    EndedError: this process, or one of the workers, was asked to end. All workers have ended by
        then.
    """
    pending, workers = deque(tasks), list[_Worker[Task]]()
    jobs = min(jobs, len(pending))
    try:
        while pending or any(worker.task is not None for worker in workers):
            while pending and len(workers) < jobs:
                workers.append(_start())
            for worker in workers:
                if worker.task is None and pending:
                    worker.task = pending.popleft()
                    with suppress(OSError):  # it has died: then its end of the pipe says so
                        worker.pipe.send((work, worker.task))
            by_pipe = {worker.pipe: worker for worker in workers}
            for pipe in wait(list(by_pipe)):
                end_if_asked()
                worker = by_pipe[pipe]  # type: ignore[index]  # wait gives what it was given
                try:
                    result = worker.pipe.recv()
                except (EOFError, OSError):
                    workers.remove(worker)
                    yield from _died(worker, tidy)
                    continue
                if result is None:
                    worker.task = None
                else:
                    yield result
    finally:
        _end(workers, tidy)


def _start() -> _Worker[Task]:
    ours, theirs = _SPAWN.Pipe()
    process = _SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
    with endings_wait():
        process.start()
    theirs.close()
    return _Worker(process, ours)


def _died(worker: _Worker[Task], tidy: Callable[[Task], None]) -> Iterator[Died[Task]]:
    worker.process.join()
    if worker.task is not None:
        tidy(worker.task)
    code = worker.process.exitcode or 0
    number = -code if code < 0 else code - _SHELL  # ended by itself, or as an exit code
    if number in ENDING:
        raise EndedError(number)
    if worker.task is not None:
        yield Died(worker.task, worker.process.exitcode)


def _end(workers: list[_Worker[Task]], tidy: Callable[[Task], None]) -> None:
    """Idle workers leave when their pipe is closed; the others are asked to, and then killed."""
    with endings_wait():
        for worker in workers:
            worker.pipe.close()
            if worker.task is not None:
                worker.process.terminate()
        until = time.monotonic() + _TO_END_S
        for worker in workers:
            worker.process.join(max(0.0, until - time.monotonic()))
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
            if worker.task is not None:
                tidy(worker.task)


# --- in the worker ----------------------------------------------------------------------------


def _serve(pipe: Connection) -> None:
    """Take tasks until the pipe is closed, or a signal comes. Their imports, which take seconds,
    come with the first task: by then signals are answered."""
    try:
        raise_when_ended(once=True)
        threading.Thread(target=_leave_with_parent, daemon=True).start()
        gone = (EOFError, BrokenPipeError, ConnectionResetError)  # the parent wants no more
        with endings_kept(), suppress(*gone):
            while True:
                work, task = pipe.recv()
                for result in work(task):
                    pipe.send(result)
                pipe.send(None)
        ignore_endings()
    except EndedError as ended:
        sys.exit(ended.exit_code)


def _leave_with_parent() -> None:
    """Wait for the parent's end, also when it was killed; then end this process."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_TO_END_S)
    os.kill(os.getpid(), signal.SIGKILL)
