"""How a kernel that only other kernels call is compiled: no further than they need.

Numba makes machine code of every function. That of a part is never run: the kernels it
belongs to take in its intermediate code, and optimise it with their own.
"""

from typing import Any

from llvmlite import binding, ir
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

__all__ = ["PartCompiler"]


class _PartLibrary(JITCodeLibrary):
    """Intermediate code to be linked into other kernels; nothing in it can be called."""

    def _optimize_final_module(self) -> None:
        """Tidy up only; the kernels that this is part of do the rest."""
        manager, builder = self._codegen._module_pass_manager(
            loop_vectorize=False,
            slp_vectorize=False,
            opt=self._codegen._opt_level,
            cost="cheap",
        )
        manager.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        """Make machine code of the environments alone, which Numba looks up by name."""
        self._finalize_dynamic_globals()
        code = self._final_module
        stub = self._codegen._create_empty_module(self.name)
        pointer = ir.IntType(8).as_pointer()
        for variable in code.global_variables:
            if variable.name.startswith("_ZN08NumbaEnv"):
                environment = ir.GlobalVariable(stub, pointer, variable.name)
                environment.linkage = "common"
                environment.initializer = ir.Constant(pointer, None)
        self._final_module = binding.parse_assembly(str(stub))
        super()._finalize_final_module()
        self._final_module = code


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    """Numba's own lowering, into a library of the kind above."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function as Numba does."""
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class PartCompiler(CompilerBase):
    """Numba's compiler of functions without Python objects, but for the last step."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [
            (_PartLowering if step is NativeLowering else step, reason)
            for step, reason in passes.passes
        ]
        passes.finalize()
        return [passes]
