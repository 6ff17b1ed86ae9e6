"""numba's `intrinsic` with a type."""

from collections.abc import Callable
from typing import Any

from numba import extending

intrinsic: Callable[[Callable[..., Any]], Callable[..., Any]] = extending.intrinsic
"""Make machine code of a generator of LLVM instructions. Typed because type checkers cannot know that it is called
without the typing context, the generator's first argument."""
