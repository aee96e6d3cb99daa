"""Tasks on an executor: the user's, or processes of this machine that end with the starting process."""

import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue

from kinetile.errors import KinetileError
from kinetile.instruments import Unbroken
from kinetile_bench.study.task import LOST, Row, StudyStopped, Task, row_of, run_task

_ANOTHER = "the study goes on with another one"


def rows_of(tasks: Iterable[Task], executor: Executor | None, workers: int | None) -> Generator[Row | None]:
    """Runs tasks; yields their rows as they arrive, and None now and then. Closing the generator ends the
    processes in the middle of their tasks. Raises StudyStopped if tasks cannot go on."""
    if executor is not None:
        broken, _ = yield from _through(executor, tasks, workers)
        if broken:
            raise StudyStopped(f"the executor has broken; {_ANOTHER}")
        return
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    left, count = list(tasks), workers or own
    while left:
        with _processes(count) as pool:
            broken, left = yield from _through(pool, left, count)
        for task in broken:  # the one that ended a worker is unknown, so each runs again, alone
            with _processes(1) as pool:
                died, _ = yield from _through(pool, [task], 1)
            if died:
                yield _lost(task, "its worker died, twice: the second time nothing else was running")


def _through(
    executor: Executor, tasks: Iterable[Task], most: int | None
) -> Generator[Row | None, None, tuple[list[Task], list[Task]]]:
    """Runs tasks, at most ``most`` at once. Returns the tasks that a broken executor had, and never had."""
    waiting, broken, tried = deque(tasks), list[Task](), list[Task]()
    under_way: dict[Future[Row], Task] = {}
    finished = SimpleQueue[Future[Row]]()
    try:
        while under_way or (waiting and not broken):
            submits = waiting and not broken and (most is None or len(under_way) < most)
            if submits:
                task = waiting.popleft()
                try:
                    future = executor.submit(run_task, task)
                except BrokenExecutor:
                    broken.append(task)
                except Exception as error:  # it was shut down, or a client of Dask is closed
                    reason = f"{type(error).__name__}: {error}"
                    raise StudyStopped(f"the executor takes no task ({reason}); {_ANOTHER}") from error
                else:
                    under_way[future] = task
                    future.add_done_callback(finished.put)
            try:  # rows that arrived during the submission of others do not wait
                future = finished.get(timeout=0.0 if submits else 0.5)
            except Empty:
                yield None
                continue
            task = under_way.pop(future)
            try:
                row = future.result()
            except (BrokenExecutor, CancelledError):
                broken.append(task)
                continue
            except KinetileError:
                raise
            except Exception as error:
                reason = f"{type(error).__name__}: {error}"
                if type(error).__name__ == "KilledWorker":  # Dask's: it has tried the task several times
                    row = _lost(task, reason)
                elif task in tried:
                    raise StudyStopped(f"a task cannot run on its worker: {reason}") from error
                else:  # Dask's ClientExecutor has a ValueError for a row that was lost with its worker
                    tried.append(task)
                    waiting.append(task)
                    continue
            yield row
        return broken, list(waiting)
    finally:
        for future in under_way:
            future.cancel()


def _lost(task: Task, reason: str) -> Row:
    return row_of(task, {"status": LOST, "error": reason})


@contextmanager
def _processes(count: int) -> Iterator[Executor]:
    context = multiprocessing.get_context("spawn")
    parent, leash = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, context, initializer=_begin, initargs=(parent,))
    try:
        try:
            with Unbroken(), _interrupts_blocked():  # workers inherit it: Ctrl-C ends no import of theirs
                started = [pool.submit(os.getpid) for _ in range(count)]
            started[0].result()
        except BrokenExecutor as error:
            raise StudyStopped(
                "the worker processes do not start. In a script, the call that runs a study must be behind "
                "`if __name__ == '__main__':`, because each worker imports the script"
            ) from error
        yield pool
    finally:
        leash.close()
        with suppress(BrokenExecutor):
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Within this context SIGINT is blocked in this thread and its children, if the system can."""
    with ExitStack() as after:
        if sys.platform != "win32":
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            after.callback(signal.pthread_sigmask, signal.SIG_SETMASK, before)
        yield


def _begin(parent: Connection) -> None:
    """Prepares a worker: only the process that runs the study handles Ctrl-C. That process holds the only
    writing end of the pipe ``parent``; when it closes it, or is killed, the worker ends, in any state."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def end_with_parent() -> None:
        with suppress(EOFError, OSError):
            parent.recv_bytes()
        os._exit(0)

    threading.Thread(target=end_with_parent, daemon=True).start()
