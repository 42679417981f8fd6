"""Compiled functions: those that Python calls ("kernels"), those that only kernels call ("parts"), and a cache on disk.

Numba's own cache keys a kernel on the time stamp of its source file, so a kernel goes on running old code when only a
function that it calls, in another file, has changed. Here the key is the content of the kernel's file and of every
module of the package that it imports, directly or not, and the versions of what compiles. Kernels lie in the user's
cache folder (numba's NUMBA_CACHE_DIR overrides it), so a read-only installation keeps its kernels too.

Numba optimises each function that a kernel calls by itself, makes machine code of it and wrappers for calls from Python
and from C, and then optimises it once more inside its caller. All but the last is for nothing if only kernels call it:
a part is optimised and turned into machine code inside each kernel that it belongs to, and nowhere else. It lies in
that kernel's file in the cache.
"""

import gc
import hashlib
import logging
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from subprocess import Popen
from typing import Any

import platformdirs
from numba import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, NullCache, _Cache, _CacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral

from motionenv._core.locks import lock

LIMIT = 400 * 2**20  # bytes of kernels on disk; one version of this library takes about 40 MB
_IMPORT = re.compile(r"^\s*(?:from|import)\s+([\w.]+)(?:\s+import\s+(\([^)]*\)|[^\n]*))?", re.MULTILINE)

_REPORT = 5.0  # [s] between reports
_began = _said = 0.0  # [s] of `time.monotonic()`: the first report and the last

#: Kernels, with types of arguments, that this process compiles while it would wait for one that another compiles.
waiting: list[tuple["_Kernel", tuple]] = []

#: Processes that compile for this one.
helpers: list[Popen] = []

logger = logging.getLogger(__name__)


def kernel(function: Callable | None = None, **options: Any) -> Any:
    """Compile a function like `numba.njit(nogil=True, error_model="numpy", **options)`, and keep it in the cache."""
    if function is None:
        return lambda wrapped: kernel(wrapped, **options)
    return _compiled(_Kernel, function, nogil=True, **options)


def part(function: Callable | None = None, **options: Any) -> Any:
    """Compile a function, like `kernel`, that only kernels and other parts call; Python can't.

    Exceptions that it raises can only have arguments that are constants.
    """
    if function is None:
        return lambda wrapped: part(wrapped, **options)
    return _compiled(_Part, function, no_cpython_wrapper=True, **options)


def _compiled(dispatcher: type, function: Callable, **options: Any) -> Any:
    """What `numba.njit` returns, with a dispatcher of this module instead of numba's."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]  # set when numba is imported
        return function
    return dispatcher(
        function, targetoptions={"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True, **options}
    )


def cache_folder() -> Path:
    """Where kernels are kept."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return Path(chosen) if chosen else platformdirs.user_cache_path("motionenv") / "kernels"


@cache
def content_key(path: Path) -> str:
    """A checksum of a source file, of all that it imports of its package, and of the compiler's versions."""
    digest = hashlib.sha256(repr([version(name) for name in ("numba", "llvmlite", "numpy")]).encode())
    for source in sorted(_imported(path)):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:20]


def _imported(path: Path) -> set[Path]:
    """The file and every file of its package that it imports, directly or not."""
    root = path
    while (root.parent / "__init__.py").is_file():
        root = root.parent
    found, waiting = set(), [path]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            waiting += _imports(file, root)
    return found


@cache
def _imports(file: Path, root: Path) -> tuple[Path, ...]:
    """Files of the package in folder `root` that `file` names in its imports."""
    files = []
    for module, names in _IMPORT.findall(file.read_text(encoding="utf-8")):
        if module.split(".")[0] == root.name:
            inner = [module, *(f"{module}.{name}" for name in re.findall(r"\w+", names))]
            files += [source for name in inner for source in _sources(root.parent / name.replace(".", "/"))]
    return tuple(files)


def _sources(stem: Path) -> Iterator[Path]:
    """The source file of a module or package, if there is one of that name."""
    for candidate in (stem.with_suffix(".py"), stem / "__init__.py"):
        if candidate.is_file():
            yield candidate


class _Locator(_CacheLocator):
    """Places a kernel in a folder that is named after its module and the content that it depends on."""

    def __init__(self, function: Callable, file: str):
        self._name = function.__module__
        self._key = content_key(Path(file))
        self._py_file = file  # numba names it where it warns of what can't be kept
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, py_func: Callable, py_file: str) -> "_Locator":
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(cache_folder() / f"{self._name}-{self._key}")

    def get_source_stamp(self) -> str:
        return self._key

    def get_disambiguator(self) -> str:
        return str(self._line)


class _Impl(CompileResultCacheImpl):
    """How numba stores a compiled function, at the place that `_Locator` says."""

    _locator_classes = [_Locator]  # noqa: RUF012 (numba declares it as an attribute)


class _Files(FunctionCache):
    """Numba's cache of one kernel."""

    _impl_class = _Impl

    def has(self, sig: Any, codegen: Any) -> bool:
        return self._index_key(sig, codegen) in self._cache_file._load_index()


class _KernelCache(_Cache):
    """The cache of one kernel, opened when the kernel is first called; reports what has to be compiled."""

    held = 0  # locks that this process holds, in all threads: those compile in turn

    def __init__(self, dispatcher: Dispatcher):
        self._dispatcher = dispatcher
        self._opened: Any = None

    def _files(self) -> Any:
        """The files, opened when first asked for: importing a kernel reads nothing."""
        if self._opened is None:
            self._opened = _Files(self._dispatcher.py_func)
            _touch(Path(self._opened.cache_path))
        return self._opened

    @property
    def cache_path(self) -> str:
        return self._files().cache_path

    def has(self, sig: Any, codegen: Any) -> bool:
        """Whether the kernel is there for these types and this processor."""
        with suppress(OSError):
            return not isinstance(self._opened, NullCache) and self._files().has(sig, codegen)
        return False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            found = self._files().load_overload(sig, target_context)
        except OSError:  # a folder that can't be read; `save_overload` says so
            found = None
        if found is None:
            _report(self._dispatcher.py_func.__name__)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        if isinstance(self._opened, NullCache):  # it could not be written before
            return
        folder = Path(self.cache_path)
        try:
            if not folder.is_dir():
                prune(folder.parent)
            self._files().save_overload(sig, data)
        except OSError as error:
            self._opened = NullCache()
            _warn_unwritable(folder.parent, error.strerror)

    @contextmanager
    def alone(self, *, wait: bool = True) -> Iterator[bool]:
        """While no other process compiles this kernel; yields whether that is so, which it always is after `wait`.

        A process that waited then loads what the other has made.
        """
        function = self._dispatcher.py_func
        name = f"{function.__module__}.{function.__qualname__}.lock".replace("<locals>", "")
        mine = True
        with ExitStack() as stack:
            with suppress(OSError):  # no locks here, or no right to write, as `save_overload` says
                folder = cache_folder() / "locks"
                folder.mkdir(parents=True, exist_ok=True)
                mine = lock(stack.enter_context(open(folder / name, "w")), wait=wait)
            _KernelCache.held += mine
            try:
                yield mine
            finally:
                _KernelCache.held -= mine

    def enable(self) -> None:
        self._files().enable()

    def disable(self) -> None:
        self._files().disable()

    def flush(self) -> None:
        self._files().flush()


class _Compiled(CPUDispatcher):
    """Compiles a function for those types with which it is called."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """The version that a compiled caller gets: numba would compile another for each number that is a constant."""
        return super().get_call_template(
            [unliteral(arg) for arg in args], {k: unliteral(arg) for k, arg in kws.items()}
        )


class _Kernel(_Compiled):
    """A function that Python may call."""

    def __init__(self, py_func: Callable, locals: dict | None = None, targetoptions: dict | None = None):
        super().__init__(py_func, locals or {}, targetoptions)
        self._cache = _KernelCache(self)

    def is_compiled(self, sig: Any) -> bool:
        """Whether there is code for arguments of these types, in this process or in the cache."""
        context: Any = self.targetctx
        return sig in self.overloads or self._cache.has(sig, context.codegen())

    def compile(self, sig: Any) -> Any:
        with global_compiler_lock, _uncollected():
            while waiting and not _KernelCache.held and not self.compile_unless_taken(sig):
                other, types = waiting.pop()  # rather than wait for the process that compiles this one
                other.compile_unless_taken(types)
            with self._cache.alone():
                return super().compile(sig)

    def compile_unless_taken(self, sig: Any) -> bool:
        """Compile, or load, unless another process compiles this kernel now; returns whether it's done."""
        with global_compiler_lock, _uncollected(), self._cache.alone(wait=False) as mine:
            if mine:
                super().compile(sig)
        return mine


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without the search for cyclic garbage, which takes a tenth of the time of compilation and finds next to nothing.

    Other threads may compile too: call it under the compiler's lock, or this may be left switched off.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


class _PartLibrary(JITCodeLibrary):
    """LLVM code of a part and of what it calls, linked but neither optimised nor turned into machine code."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout  # modules can only be linked if they agree on it

    def _optimize_final_module(self) -> None:
        """Leave that to the kernel's library, into which this is linked."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _PartCompiler(Compiler):
    """Numba's passes, the last of which ends when LLVM code is written: that needs a library that goes no further."""

    def define_pipelines(self) -> list:
        self.state.flags.no_compile = True
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()


class _Part(_Compiled):
    """A function that only kernels call."""

    def __init__(self, py_func: Callable, locals: dict | None = None, targetoptions: dict | None = None):
        super().__init__(py_func, locals or {}, targetoptions, pipeline_class=_PartCompiler)

    def add_overload(self, cres: Any) -> None:
        """Make a part known to those that call it, which numba does in the step that `_PartCompiler` leaves out.

        Numba finds the code of a function by its entry point, an address; any object serves instead. The base class
        would also let Python call the entry point.
        """
        entry = object()
        self.targetctx.insert_user_function(entry, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres._replace(entry_point=entry)

    def _compile_for_args(self, *args: Any, **kws: Any) -> None:
        """What a call from Python comes to, as no code for it is there."""
        raise TypeError(f"{self.py_func.__name__} is a part of kernels: call it from a kernel")


@cache
def _warn_unwritable(folder: Path, why: str) -> None:
    """Say, once, that kernels will be compiled again."""
    logger.warning(
        "can't keep compiled kernels in %s (%s), so each process compiles them again: set the environment variable "
        "NUMBA_CACHE_DIR to a folder that can be written", folder, why,
    )  # fmt: skip


def _touch(folder: Path) -> None:
    """Mark a folder as used now, so that `prune` keeps it."""
    try:
        os.utime(folder)
    except OSError:  # not there yet, or somebody else's
        return


def prune(folder: Path) -> None:
    """Delete the kernels in `cache_folder()` that were unused for longest until the rest has at most `LIMIT` bytes."""
    if not folder.is_dir():
        return
    bytes_of = lambda each: sum(file.stat().st_size for file in each.iterdir())
    kept = [(each.stat().st_mtime, each, bytes_of(each)) for each in folder.iterdir() if any(each.glob("*.nbi"))]
    total = sum(size for _, _, size in kept)
    for _, each, size in sorted(kept):
        if total <= LIMIT:
            return
        shutil.rmtree(each, ignore_errors=True)  # another process may be deleting it as well
        total -= size


def announce(what: str, how_far: str = "") -> None:
    """Say what is being compiled."""
    global _began, _said
    _said = time.monotonic()
    _began = _began or _said
    logger.warning("compiling %s, once for this version and machine%s", what, how_far)


def _report(name: str) -> None:
    """Say which kernel is being compiled, at first and then every few seconds, and whether a helper failed."""
    for failed in [helper for helper in helpers if helper.poll()]:
        helpers.remove(failed)
        logger.warning(
            "a process that compiled kernels ended with exit code %d: %s is compiled here", failed.returncode, name
        )
    now = time.monotonic()
    if now - _said >= _REPORT:
        announce("kernels", f": {name}, {now - (_began or now):.0f} s")
