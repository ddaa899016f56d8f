"""CasADi functions as machine code: generated to C, built once, cached by content hash."""

from bluefoot_mpc.codegen.config import CodegenConfig
from bluefoot_mpc.codegen.function import compiled
from bluefoot_mpc.codegen.memo import made_once
from bluefoot_mpc.codegen.mode import CodegenMode, codegen_mode, compiler_available

__all__ = ["CodegenConfig", "CodegenMode", "codegen_mode", "compiled", "compiler_available", "made_once"]
