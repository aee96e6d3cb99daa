"""SHA-256 by the processor's own instructions, where it has them (x86: SHA extensions).

The compression function in portable code needs some 2,400 instructions a block of 64 bytes, and these some
150. They are LLVM intrinsics of one architecture, so ``HAS_SHA256`` says whether Numba compiles for a
processor that has them; if not, the code that calls them must not be compiled.
"""

from __future__ import annotations

from typing import Any

from kinetile.kernel.compiled import INTERPRETED


def _has_sha256() -> bool:
    """Whether Numba compiles for an x86 processor with SHA extensions: ``NUMBA_CPU_FEATURES`` may deny it."""
    if INTERPRETED:
        return False
    from numba.core.registry import cpu_target

    library: Any = cpu_target.target_context.codegen()
    triple, _, features = library.magic_tuple()[:3]
    return triple.startswith("x86_64") and "+sha" in features.split(",")


HAS_SHA256 = _has_sha256()

if not INTERPRETED:
    from llvmlite import ir
    from numba import types as _types
    from numba.core import cgutils as _cgutils
    from numba.extending import intrinsic

    types: Any = _types
    cgutils: Any = _cgutils
    _WORD, _BYTE, _INDEX = ir.IntType(32), ir.IntType(8), ir.IntType(64)
    _FOUR = ir.VectorType(_WORD, 4)

    def _call(builder: Any, name: str, *arguments: Any) -> Any:
        """Call an LLVM intrinsic of vectors of four words."""
        kind = ir.FunctionType(_FOUR, [_FOUR] * len(arguments))
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), arguments)

    def _shuffle(builder: Any, one: Any, two: Any, *lanes: int) -> Any:
        """Return four lanes of two vectors."""
        mask = ir.Constant(ir.VectorType(_WORD, 4), [ir.Constant(_WORD, i) for i in lanes])
        return builder.shuffle_vector(one, two, mask)

    def _take_in_blocks(typing_context: Any, words: Any, content: Any, rounds: Any) -> Any:
        """Take the whole blocks of an array of bytes into the eight words of a state.

        An instruction does two rounds, with the state in the order (f, e, b, a), (h, g, d, c) from the
        lowest lane, and the message word plus the round's constant in the two lowest lanes of a third vector.
        """

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            state, blocks, constants = (
                context.make_array(kind)(context, builder, value=value)
                for kind, value in zip(signature.args, arguments, strict=True)
            )

            def four(pointer: Any, byte: int, align: int) -> Any:
                at = builder.gep(builder.bitcast(pointer, _BYTE.as_pointer()), [ir.Constant(_INDEX, byte)])
                return builder.bitcast(at, _FOUR.as_pointer()), align

            def load(pointer: Any, byte: int, align: int) -> Any:
                at, align = four(pointer, byte, align)
                return builder.load(at, align=align)

            low, high = load(state.data, 0, 4), load(state.data, 16, 4)
            one = cgutils.alloca_once_value(builder, _shuffle(builder, low, high, 5, 4, 1, 0))
            other = cgutils.alloca_once_value(builder, _shuffle(builder, low, high, 7, 6, 3, 2))
            count = builder.udiv(blocks.nitems, ir.Constant(_INDEX, 64))
            with cgutils.for_range(builder, count) as loop:
                begin = builder.gep(blocks.data, [builder.mul(loop.index, ir.Constant(_INDEX, 64))])
                abef, cdgh = before = builder.load(one), builder.load(other)
                # Big-endian words; unaligned, since a block may begin anywhere.
                w = [_call(builder, "llvm.bswap.v4i32", load(begin, 16 * i, 1)) for i in range(4)]
                for i in range(16):  # four rounds each
                    if i >= 4:
                        seven_ago = _shuffle(builder, w[i - 2], w[i - 1], 1, 2, 3, 4)
                        sums = _call(builder, "llvm.x86.sha256msg1", w[i - 4], w[i - 3])
                        sums = builder.add(sums, seven_ago)
                        w.append(_call(builder, "llvm.x86.sha256msg2", sums, w[i - 1]))
                    added = builder.add(w[i], load(constants.data, 16 * i, 4))
                    cdgh = _call(builder, "llvm.x86.sha256rnds2", cdgh, abef, added)
                    added = _shuffle(builder, added, added, 2, 3, 2, 3)
                    abef = _call(builder, "llvm.x86.sha256rnds2", abef, cdgh, added)
                builder.store(builder.add(abef, before[0]), one)
                builder.store(builder.add(cdgh, before[1]), other)
            abef, cdgh = builder.load(one), builder.load(other)
            for byte, lanes in ((0, (3, 2, 7, 6)), (16, (1, 0, 5, 4))):
                at, align = four(state.data, byte, 4)
                builder.store(_shuffle(builder, abef, cdgh, *lanes), at, align=align)
            return context.get_dummy_value()

        return types.void(words, content, rounds), codegen

    take_in_blocks: Any = intrinsic(_take_in_blocks)
