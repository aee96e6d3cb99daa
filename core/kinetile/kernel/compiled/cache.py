"""Machine code on disk: Numba's cache in another place, with a checksum in each file.

Numba keeps machine code beside the sources, and drops it when the date of a source changes. So each new
environment, checkout or installation would compile everything again. This cache is in the user's cache
directory, shared by all of them: the name of a function has the fingerprint of everything it was made from
(``fingerprint``), the folder has the versions of Numba and llvmlite, and the index has the processor. Writing
a loop removes files that were not used for thirty days, and, beyond half a gigabyte, the least recently used
ones.

Hooks are kept here as well, as LLVM's bitcode: after an edit of a hook, Numba compiles this hook, its callers
and the loop. The bitcode names no processor; it is still kept for one, as machine code is.

Numba loads any file in its cache: a file that is damaged, or copied over another, would end every later run,
or crash it, or compute something else. So each file ends with a digest of its key (the signature, the
processor, the function's code) and with the SHA-256 of its name and of everything before it, and nothing is
unpickled before both are compared. A wrong entry is dropped, and the code is compiled again; the log
``kinetile`` (on stderr, if logging is not set up) has one line a loop for all such entries. Only regular
files are opened. A read-only folder is still read, such as one that ``kinetile cache warm`` has filled; each
process compiles the missing code, and the log says so.
"""

import hashlib
import io
import logging
import os
import pickle
import re
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache, partial
from pathlib import Path
from types import FunctionType, SimpleNamespace
from typing import Any, cast

import platformdirs

from kinetile.kernel.compiled import backend
from kinetile.kernel.compiled.backend import FunctionCache, IndexDataCacheFile, llvmlite, numba
from kinetile.kernel.compiled.fingerprint import APART
from kinetile.sources import open_regular

_DIGEST = 32
_NO_KEY = bytes(_DIGEST)
_UNUSED_SECONDS = 30 * 86400.0
_MOST_BYTES = 512_000_000
_WRITING_SECONDS = 3600.0
"""After this time an unfinished file, without its final name, belongs to a process that was killed."""


def folder() -> Path:
    """Returns the folder of machine code for these versions: ``NUMBA_CACHE_DIR`` moves it."""
    root = numba.config.CACHE_DIR or platformdirs.user_cache_dir("kinetile", appauthor=False)
    return Path(root) / f"numba-{numba.__version__}-llvmlite-{llvmlite.__version__}"


def not_kept(error: Exception) -> str:
    """Returns the sentence on machine code that cannot be written."""
    why = getattr(error, "strerror", None) or error
    return (
        f"machine code cannot be kept in {folder()} ({why}): each process compiles again what is not there; "
        "set NUMBA_CACHE_DIR to a folder that can be written"
    )


def problem() -> str:
    """Returns a sentence on why no machine code can be written now, or "". Makes no folder."""
    place = folder()
    try:
        with tempfile.TemporaryFile(dir=next(x for x in (place, *place.parents) if x.exists())) as file:
            file.write(bytes(100_000))
    except OSError as error:
        return not_kept(error)
    return ""


_tell_once = cache(partial(logging.getLogger("kinetile").warning, "kinetile: %s"))


class _Place(backend.CompileResultCacheImpl):
    """The data of a cache's place for Numba. Numba's own places need a writable folder, even if nothing is
    written, and compare dates of sources: here the fingerprint in the name replaces these dates."""

    def __init__(self, function: Callable[..., Any]) -> None:
        code = cast(FunctionType, function).__code__
        self._lineno, self._filename_base = code.co_firstlineno, function.__qualname__
        self._locator = SimpleNamespace(
            get_cache_path=lambda: str(folder()),
            get_source_stamp=str,
            ensure_cache_path=lambda: None,  # a folder is made when a file is written
            _py_file=code.co_filename,  # for Numba's warning of code that it cannot keep: unoptimised code
        )


class CheckedCache(FunctionCache):
    """Numba's cache of one function; damaged files count as missing."""

    _impl_class = _Place

    def __init__(self, function: Callable[..., Any]) -> None:
        cast(Any, super()).__init__(function)
        self._cache_file = cast(Any, _CheckedFiles)(self._cache_path, self._impl.filename_base, "")

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Returns the machine code for a signature, or None without a correct file."""
        try:
            return cast(Any, super()).load_overload(signature, target_context)
        except Exception as error:  # unpickling another version's files may raise anything
            _say_dropped(self._py_func.__qualname__, error)
            with suppress(OSError):  # then the next process reports this again
                cast(Any, self).flush()
            return None

    def save_overload(self, signature: Any, data: Any) -> None:
        """Writes the machine code for a signature; without room on the disk, the next process compiles it."""
        try:
            cast(Any, super()).save_overload(signature, data)
            _remove_unused(Path(self._cache_path))
        except (OSError, ValueError) as error:  # the latter: an index that could not be dropped
            _tell_once(not_kept(error))


class KeptHook:
    """The code of a hook on disk, as LLVM's bitcode, under the digest of everything it is made from: its
    fingerprint and key. After a change in one hook only its callers are compiled again."""

    def __init__(self, function: Callable[..., Any], digest: str, key: str) -> None:
        self._key = digest, key, folder().name
        found = hashlib.sha256(repr(self._key).encode()).hexdigest()[:32]
        self.name = f"{function.__name__}_{found}"
        self._files = cast(Any, _CheckedFiles)(str(folder()), self.name, "")
        self._files._dump = pickle.dumps  # Numba's own takes five times as long, and copies unknown classes
        self._file = f"{self.name}.nbh"

    def load(self) -> Any:
        """Returns the saved code, or None without a correct file."""
        try:
            with self._files._of(self._key):
                found = self._files._load_data(self._file)
        except FileNotFoundError:
            return None
        except Exception as error:  # as of machine code
            _say_dropped(self.name, error)
            with suppress(OSError):
                os.unlink(self._files._data_path(self._file))
            return None
        return found

    def save(self, data: Any) -> None:
        """Writes the code; without room, or with a type that has no name, the next process compiles it."""
        try:
            with suppress(pickle.PicklingError, AttributeError, TypeError), self._files._of(self._key):
                self._files._save_data(self._file, data)
        except OSError as error:
            _tell_once(not_kept(error))


_dropped: ContextVar[list[tuple[str, Exception]] | None] = ContextVar("dropped", default=None)


@contextmanager
def dropped_together() -> Iterator[None]:
    """Logs all that is dropped within this context in one line: a loop has some 150 files."""
    token = _dropped.set([])
    try:
        yield
    finally:
        dropped = _dropped.get()
        _dropped.reset(token)
        if dropped:
            _say_dropped(*dropped[0], others=len(dropped) - 1)


def _say_dropped(name: str, error: Exception, others: int = 0) -> None:
    if not os.path.isdir(folder()):
        return  # nothing is dropped: the failing write reports itself
    together = _dropped.get()
    if together is not None:
        together.append((name, error))
        return
    logging.getLogger("kinetile").warning(
        "kinetile: the machine code of %s in %s cannot be used (%s): it is dropped, and compiled again",
        f"{name} and {others} more functions" if others else name,
        folder(),
        str(error) or type(error).__name__,
    )


def _remove_unused(place: Path) -> None:
    """Removes files that no process has read or written for thirty days, and the least recently used ones if
    all have more than ``_MOST_BYTES``."""
    found = []
    for entry in os.scandir(place):
        with suppress(OSError):  # another process has removed it
            of = entry.stat()
            found.append((max(of.st_atime, of.st_mtime), of.st_size, entry.path))
    now, room = time.time(), _MOST_BYTES
    for used, size, path in sorted(found, reverse=True):
        room -= size
        if used < now - (_WRITING_SECONDS if ".tmp." in path else _UNUSED_SECONDS) or room < 0:
            with suppress(OSError):
                os.unlink(path)


_NAMED = re.compile(rb"(?=(kinetile_\w+?_[0-9a-f]{16}))")
"""A pattern for such names: one may begin within another one."""


class _CheckedFiles(IndexDataCacheFile):
    """The files of an entry: an index of signatures, and the machine code for each."""

    _key = _NO_KEY

    def load(self, key: Any) -> Any:
        with self._of(key):
            return cast(Any, super()).load(key)

    def save(self, key: Any, data: Any) -> None:
        with self._of(key):
            cast(Any, super()).save(key, data)

    @contextmanager
    def _of(self, key: Any) -> Iterator[None]:
        self._key = hashlib.sha256(repr(key).encode()).digest()
        try:
            yield
        finally:
            self._key = _NO_KEY

    def _key_in(self, path: str) -> bytes:
        """Returns the key of a file: machine code has one, an index has many."""
        return _NO_KEY if path == self._index_path else self._key

    def _load_index(self) -> Any:
        with suppress(FileNotFoundError):
            self._check(self._index_path)
            _touch(self._index_path)
        return cast(Any, super())._load_index()

    def _load_data(self, name: str) -> Any:
        path = cast(Any, self)._data_path(name)
        content = self._check(path)
        _touch(path)
        for called in {each.decode() for each in _NAMED.findall(content)}:
            if called in APART and not name.startswith(called):
                APART[called]()
        return cast(Any, super())._load_data(name)

    def _check(self, path: str) -> memoryview:
        key, content = _read(path)
        if key != self._key_in(path):
            raise ValueError("damaged: its checksum is another, or that of another file")
        return content

    @contextmanager
    def _open_for_write(self, path: str) -> Iterator[io.BytesIO]:
        os.makedirs(os.path.dirname(path), mode=0o755, exist_ok=True)
        with cast(Any, super())._open_for_write(path) as file:
            content = io.BytesIO()
            yield content
            content.write(self._key_in(path))
            file.write(content.getvalue())
            file.write(_checksum(path, content.getbuffer()))


def _touch(path: str) -> None:
    """Notes that a file is in use: many systems do not note when a file is read."""
    with suppress(OSError):
        os.utime(path, ns=(time.time_ns(), os.stat(path).st_mtime_ns))


def is_whole(path: str | os.PathLike[str]) -> bool:
    """Returns True if a file of the cache ends with its checksum; OSError if it is not a regular file."""
    return _read(path)[0] is not None


def _read(path: str | os.PathLike[str]) -> tuple[bytes | None, memoryview]:
    """Returns the key of a file, or None if its checksum is wrong, and the content."""
    with open_regular(path) as file:
        content = memoryview(file.read())
    whole = _checksum(path, content[:-_DIGEST]) == content[-_DIGEST:]
    return bytes(content[-2 * _DIGEST : -_DIGEST]) if whole else None, content


def _checksum(path: str | os.PathLike[str], content: Any) -> bytes:
    found = hashlib.sha256(os.path.basename(os.fspath(path)).encode() + b"\0")
    found.update(content)
    return found.digest()
