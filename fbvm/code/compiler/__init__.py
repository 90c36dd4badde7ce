"""The compiler: sources in; an Image, or diagnostics that say why there is none, out."""

from fbvm.code.compiler.compilation import LONG as LONG
from fbvm.code.compiler.compilation import Compilation as Compilation
from fbvm.code.compiler.driver import compile_files as compile_files
from fbvm.code.compiler.driver import compile_sources as compile_sources
from fbvm.code.compiler.driver import compile_text as compile_text
