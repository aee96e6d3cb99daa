"""Numba and LLVM: the only file that imports them, with the parts that are not public.

Numba promises its public names for a year or two, and nothing about the others. So these are here, with the
versions of Numba that they are tested with (pyproject.toml has the same). The import of this file compares
them with the installed Numba: a part that is missing, or lacks a member that kinetile overrides or reads, is
named in one sentence, before anything is compiled.
"""

import operator
from collections.abc import Callable, Iterable
from functools import cache, partial
from inspect import Parameter, Signature
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, cast

import llvmlite as llvmlite
import numba as _numba
from llvmlite import binding as _binding
from llvmlite import ir as ir
from llvmlite.binding import add_symbol as add_symbol
from numba import extending as _extending
from numba import types as _types
from numba.extending import infer_getattr as infer_getattr
from numba.extending import intrinsic as intrinsic
from numba.extending import lower_builtin as lower_builtin
from numba.extending import models as models
from numba.extending import register_model as register_model

VERSIONS = ">=0.60,<0.69"
"""The supported versions of Numba, by their private parts."""


FOLDER = str(Path(_numba.__file__).parent)
"""Numba's own code."""


def misfit(what: str) -> str:
    """Returns the message for a part of Numba that has changed."""
    return (
        f"kinetile uses parts of Numba that are not public, and numba {_numba.__version__} has other ones: "
        f"{what}; install numba{VERSIONS}"
    )


try:
    from numba.core import cgutils as _cgutils
    from numba.core.bytecode import FunctionIdentity
    from numba.core.caching import CompileResultCacheImpl as CompileResultCacheImpl
    from numba.core.caching import FunctionCache as FunctionCache
    from numba.core.caching import IndexDataCacheFile as IndexDataCacheFile
    from numba.core.ccallback import CFunc
    from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
    from numba.core.compiler import Compiler, compile_result
    from numba.core.compiler_machinery import PassManager
    from numba.core.cpu import CPUContext
    from numba.core.environment import Environment
    from numba.core.errors import NumbaExperimentalFeatureWarning as NumbaExperimentalFeatureWarning
    from numba.core.registry import CPUDispatcher as CPUDispatcher
    from numba.core.types import Array as Array
    from numba.core.types import Type as Type
    from numba.core.typing.context import Context
    from numba.core.typing.templates import AttributeTemplate as AttributeTemplate
    from numba.core.typing.templates import ConcreteTemplate as ConcreteTemplate
    from numba.core.typing.templates import infer_global as infer_global
    from numba.np import arrayobj as _arrayobj
except ImportError as error:
    raise ImportError(misfit(str(error))) from error

numba: Any = _numba
NativeValue: Any = _extending.NativeValue
lower_getattr_generic: Any = _extending.lower_getattr_generic
unbox: Any = _extending.unbox
types: Any = _types
cgutils: Any = _cgutils
arrayobj: Any = _arrayobj

MEMBERS: dict[Any, str] = {
    FunctionCache: "load_overload save_overload flush _impl _impl_class _cache_path _cache_file _py_func",
    CompileResultCacheImpl: "filename_base locator _filename_base _locator _lineno",
    IndexDataCacheFile: "load save _load_index _load_data _save_data _dump _data_path _index_path "
    "_open_for_write",
    CFunc: "compile address _cache",
    JITCodeLibrary: "codegen _codegen _optimize_functions _optimize_final_module "
    "_finalize_final_module _finalize_dynamic_globals has_dynamic_globals _finalized _final_module "
    "_shared_module _ensure_finalized enable_object_caching",
    JITCPUCodegen: "_module_pass_manager magic_tuple",
    Compiler: "compile_extra define_pipelines _compile_bytecode state",
    Environment: "from_fndesc",
    FunctionIdentity: "from_function func func_qualname unique_id",
    PassManager: "passes",
    Context: "refresh resolve_value_type resolve_function_type resolve_getattr",
    CPUContext: "refresh subtarget install_registry typing_context _registries get_executable "
    "insert_user_function codegen get_constant_generic get_constant_null",
    CPUDispatcher: "get_call_template get_overload py_func compile _cache",
    _cgutils: "create_struct_proxy get_null_value get_or_insert_function",
    _arrayobj: "load_item store_item get_itemsize populate_array getitem_arraynd_intp setitem_array "
    "getiter_array",
    cast(Any, _extending)._Intrinsic: "_defn",
    types.BaseTuple: "from_types",
    types.Function: "get_call_type templates typing_key _code",
    types: "unliteral",
}
"""Members that are overridden, set, called or read."""


def _mentions(part: Any, name: str) -> bool:
    """Returns True if a class has a member, or its methods set or read an attribute of this name."""
    members = (each for base in getattr(part, "__mro__", ()) for each in vars(base).values())
    functions = (getattr(each, "__func__", each) for each in members)  # class methods as well
    codes = (each.__code__ for each in functions if isinstance(each, FunctionType))
    return hasattr(part, name) or any(name in each.co_names for each in codes)


def check() -> None:
    """Compares the installed Numba with ``MEMBERS``; raises ImportError with the missing member."""
    for part, names in MEMBERS.items():
        for name in names.split():
            if not _mentions(part, name):
                raise ImportError(misfit(f"{part.__name__} has no {name}"))


check()


class _NoEnvironment:
    """Numba's code generator, without machine code that needs the address of a function's environment."""

    def __init__(self, generator: Any) -> None:
        self._generator = generator

    def __getattr__(self, name: str) -> Any:
        return getattr(self._generator, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Does nothing: only code with Python objects reads an environment, and hooks have no objects."""


class _Code(JITCodeLibrary):
    """The code of a function that Python calls: optimised once, together with all code linked into it."""

    def _optimize_functions(self, module: Any) -> None:
        """Leaves this for later: a small loop would be optimised alone first, and so all its code twice."""
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Leaves out the round for reference counts, and vectorises pairs along x and y."""
        made = cast(Any, self._codegen)._module_pass_manager(slp_vectorize=True)
        passes, *how = made if isinstance(made, tuple) else (made,)  # alone before Numba 0.62
        passes.run(self._final_module, *how)


class _LinkedCode(_Code):
    """The code of a hook or a subroutine, which is only linked into its callers: it is not made machine code,
    and is optimised alone only by passes that shorten it, which saves time to compile a loop."""

    @property
    def codegen(self) -> Any:
        return _NoEnvironment(self._codegen)

    has_arrays = False
    """Whether the function takes NumPy's arrays."""

    def _optimize_functions(self, module: Any) -> None:
        """Splits arrays into parts: code on disk, linked into each caller, has a fifth of the instructions.
        Other hooks are left as they are: the loop would become different code, hardly sooner."""
        super()._optimize_functions(module)
        if self.has_arrays and hasattr(self._codegen, "_pass_builder"):  # the latter not before Numba 0.62
            how = cast(Any, self._codegen)._pass_builder()
            passes = _binding.create_new_function_pass_manager()
            passes.add_sroa_pass()
            passes.add_instruction_combine_pass()
            for each in module.functions:
                passes.run(each, how)

    def _optimize_final_module(self) -> None:
        """Leaves this to the callers."""

    def _get_module_for_linking(self) -> Any:
        """Returns the module that callers link: Numba would copy it first, and nothing else uses it."""
        cast(Any, self)._ensure_finalized()
        if self._shared_module is None:
            self._shared_module = self._final_module
            for each in self._final_module.functions:
                if not each.is_declaration and each.linkage == _binding.Linkage.external:
                    each.linkage = "linkonce_odr"
        return self._shared_module

    def _finalize_final_module(self) -> None:
        """Marks the code as complete, without making machine code of it."""
        cast(Any, self)._finalize_dynamic_globals()
        self._finalized = True


class _Function(types.Function):  # type: ignore[misc]
    """Numba's type of a function, such as an operator, which remembers the types of calls: type inference
    needs each twice and lowering once more, and Numba tries up to forty candidates each time."""

    def __init__(self, of: Any) -> None:
        super().__init__(of.templates)
        self._known: dict[tuple[int, ...], Any] = {}

    def get_call_type(self, context: Any, given: Any, named: Any) -> Any:
        if named:
            return super().get_call_type(context, given, named)
        if self.typing_key in _OPERATORS and all(isinstance(each, _NUMBERS) for each in given):
            given = [types.unliteral(each) for each in given]
        key = tuple([each._code for each in given])
        if key not in self._known:
            self._known[key] = super().get_call_type(context, tuple(given), named)
        return self._known[key]


register_model(_Function)(models.OpaqueModel)

_NUMBERS = (types.Number, types.Boolean)
_OPERATORS = frozenset(filter(callable, vars(operator).values())) - {operator.pow, operator.ipow}
"""The operators that give a constant the same type as a variable."""


class _Typing(Context):
    """Numba's typing context, which remembers the types of functions and fields."""

    __slots__ = ("_known",)

    def __init__(self, of: Any) -> None:
        self.__dict__ = of.__dict__
        self._known: dict[Any, Any] = {}

    def refresh(self) -> None:
        """Does nothing: this is done when the outermost function is compiled."""

    def resolve_value_type(self, value: Any) -> Any:
        kind = cast(Any, super()).resolve_value_type(value)
        return self._remembered(kind, lambda: _Function(kind)) if type(kind) is types.Function else kind

    def resolve_function_type(self, function: Any, given: Any, named: Any) -> Any:
        known = self.resolve_value_type(function) if function in _OPERATORS else function
        return cast(Any, super()).resolve_function_type(known, given, named)

    def resolve_getattr(self, kind: Any, name: str) -> Any:
        found = partial(cast(Any, super()).resolve_getattr, kind, name)
        return found() if isinstance(kind, types.Module) else self._remembered((kind._code, name), found)

    def _remembered(self, key: Any, find: Callable[[], Any]) -> Any:
        if key not in self._known:
            self._known[key] = find()
        return self._known[key]


_typing = cache(lambda context, flags: _Typing(context))
"""The typing context for these flags of the compiler: the types of calls may depend on them."""


def _install(target: Any) -> None:
    """Enters new code in Numba's target context: the code of an intrinsic exists once it has been typed."""
    for registry in target._registries:
        target.install_registry(registry)


def _constant(target: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Returns a constant. For a called function it would be the address of a Python object, which no code
    reads, and which would prevent code from being kept on disk."""
    if isinstance(kind, types.Dispatcher):
        return target.get_constant_null(kind)
    return target.get_constant_generic(builder, kind, value)


_NEEDLESS = {"IRProcessing", "InlineClosureLikes", "NopythonRewrites"}
"""Passes for functions with functions in them and for NumPy's arrays; the first is done before, too."""


class _Compiler(Compiler):
    """Numba's compiler, which remembers types, and leaves out passes that change nothing for most hooks."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        known = _typing(typing, rest[2].summary())
        there = target.subtarget(
            typing_context=known,
            refresh=partial(_install, target),
            get_constant_generic=partial(_constant, target),
        )
        cast(Any, super()).__init__(known, there, library, *rest)

    def define_pipelines(self) -> Any:
        [found] = cast(Any, super()).define_pipelines()
        code = self.state.func_id.code
        inner = "reduce" in code.co_names or any(isinstance(each, CodeType) for each in code.co_consts)
        if not inner and not any(map(_has_arrays, self.state.args)):
            found.passes = [each for each in found.passes if each[0].__name__ not in _NEEDLESS]
        return [found]


def told(kind: Any) -> str | None:
    """Returns a name for a type that is the same in any process; None without one, as for a function."""
    if isinstance(kind, types.BaseTuple):
        inner = [told(each) for each in kind]
        named = isinstance(kind, types.BaseNamedTuple)
        own = (kind.instance_class.__module__, kind.instance_class.__qualname__, kind.fields) if named else ()
        return None if None in inner else repr((type(kind).__name__, own, inner))
    if hasattr(kind, "of"):  # tables, or a view
        of = told(kind.of)
        return of and f"{type(kind).__name__}({of})"
    return str(kind) if isinstance(kind, _PLAIN) or type(kind).__module__.startswith("kinetile.") else None


_PLAIN = (types.Number, types.Boolean, types.NoneType, types.Record, types.Array, types.CPointer)


def _has_arrays(kind: Any) -> bool:
    inner = kind if isinstance(kind, types.BaseTuple) else ()
    return type(kind) is Array or any(map(_has_arrays, inner))


_KEPT = "B2v0"
"""Within the names of functions, with the number 0 in place of Numba's number in a process."""


class LinkingCompiler(_Compiler):
    """The compiler of code that is only linked into its callers. Its code may be kept on disk, as LLVM's
    bitcode (``cache.KeptHook``), and so has names that no process gives to other code."""

    kept: Callable[[Any, str], Any]
    """Returns the place of a function's code, by the other things it depends on: an object with a name that
    loads and saves it; or None."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        own = library or cast(Any, _LinkedCode)(target.codegen(), "hook")
        own.has_arrays = any(map(_has_arrays, rest[0]))
        super().__init__(typing, target, own, *rest)

    def _compile_bytecode(self) -> Any:
        state, found = self.state, self.state.func_id
        code = found.func.__code__
        if "print" in code.co_names and "print" not in found.func.__globals__:
            # Numba's print would keep the interpreter's lock: linked code has no environment.
            at = f'File "{code.co_filename}", line {code.co_firstlineno}:'  # in Numba's form of a place
            raise TypeError(f"{code.co_name} calls print; hooks can, as Python (compiled=False)\n{at}")
        kinds = [told(each) for each in state.args]
        processor = state.targetctx.codegen().magic_tuple()
        kept = self.kept(found.func, repr((kinds, state.flags.summary(), processor)))
        if kept is None or None in kinds:
            return cast(Any, super())._compile_bytecode()
        found.func_qualname, found.unique_id = kept.name, 0
        loaded = kept.load()
        if loaded is not None:
            return self._taken(*loaded)
        result = cast(Any, super())._compile_bytecode()
        if not (state.library.has_dynamic_globals or state.reload_init or result.environment.consts):
            module = state.library._final_module
            for each in module.functions:  # names with Numba's number of this process stay private
                if not each.is_declaration and each.name.startswith("_ZN") and _KEPT not in each.name:
                    each.linkage = "internal"
            result.fndesc.typemap = result.fndesc.calltypes = None
            kept.save((module.as_bitcode(), result.fndesc, result.signature))
        return result

    def _taken(self, bitcode: bytes, described: Any, signature: Any) -> Any:
        library, target = self.state.library, self.state.targetctx
        library._final_module, library._finalized = _binding.parse_bitcode(bitcode), True
        environment = cast(Any, Environment).from_fndesc(described)
        entry = target.get_executable(library, described, environment)
        target.insert_user_function(entry, described, [library])
        return cast(Any, compile_result)(
            typing_context=self.state.typingctx,
            target_context=target,
            entry_point=entry,
            signature=signature,
            objectmode=False,
            fndesc=described,
            library=library,
            environment=environment,
        )


class EntryCompiler(_Compiler):
    """The compiler of functions that Python calls."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        typing.refresh()
        target.refresh()
        own = library or cast(Any, _Code)(target.codegen(), "entry")
        own.enable_object_caching()
        super().__init__(typing, target, own, *rest)


def entry(function: Callable[..., Any], cache: Any, before: Callable[[Any, Any], Any]) -> Any:
    """Returns a function that Python calls; ``before(compile, signature)`` compiles it. ``cache`` makes its
    cache on disk, or is None."""
    how = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, "pipeline_class": EntryCompiler}
    made = numba.njit(**how)(function)
    if cache is not None:
        made._cache = cache(function)
    compiles = made.compile
    made.compile = lambda signature: before(compiles, signature)
    return made


def lowered(
    name: str, parameters: Iterable[str], typed: Callable[..., Any], build: Callable[..., Any]
) -> Any:
    """Returns a function for compiled code alone. ``typed`` returns its signature for types of arguments, or
    None for unsupported ones. ``build(context, builder, signature, arguments)`` makes the code of a call."""

    def typing(context: Any, *given: Any) -> Any:
        found = typed(*given)
        return found if found is None else (found, build)

    names = ("typing_context", *parameters)
    known: Any = typing
    known.__signature__ = Signature([Parameter(each, Parameter.POSITIONAL_OR_KEYWORD) for each in names])
    known.__name__ = name
    return intrinsic(known)


class _Both(type(intrinsic(lambda typing_context: None))):  # type: ignore[misc]
    """An intrinsic that is a Python function when called from Python. (Numba's class has no public name.)"""

    def __call__(self, *arguments: Any) -> Any:
        return self.python(*arguments)


def both(python: Callable[..., Any]) -> Callable[[Any], Any]:
    """Marks an intrinsic, above ``intrinsic``, which is ``python`` when Python calls it."""

    def decorated(made: Any) -> Any:
        made.__class__ = _Both
        made.python = python
        return made

    return decorated


def at_an_address(function: Callable[..., Any], signature: Any, cache: Any) -> Any:
    """Returns a compiled function with an ``address``; ``cache`` makes its cache on disk."""
    made = cast(Any, CFunc)(
        function, (signature.args, signature.return_type), locals={}, options={"error_model": "numpy"}
    )
    made._cache = cache(function)
    made.compile()
    return made
