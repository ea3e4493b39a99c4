"""Write the time steps of loose blocks as WebAssembly for pages, from the sources of Python.

Numba compiles a wrapper with plain pointers and numbers as arguments, without optimisation, since
its own would be for this processor. LLVM optimises that code for wasm32, and zig links it with a C
library and the few functions of numba's runtime that kernels call.

Run as `make wasm`, which also writes `docs/try`.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

import archfem
from archfem.view.pages.live import LAYOUT, WASM

EXPORTED = "advance_steps"

RUNTIME = Path(__file__).with_suffix(".c")
_KERNELS = Path(archfem.__file__).parent / "dynamics" / "rigid_body"
SOURCES = (
    *(_KERNELS / f"{name}.py" for name in ("bodies", "contact_detection", "time_stepping")),
    Path(__file__),
    RUNTIME,
)

# Environment of the export: code for no special processor, apart from the usual compiled code
SETTINGS = {"NUMBA_CPU_NAME": "generic", "NUMBA_OPT": "0", "NUMBA_SLP_VECTORIZE": "0"}
SETTINGS |= {"NUMBA_LOOP_VECTORIZE": "0", "OPENBLAS_NUM_THREADS": "1"}


class StepState(NamedTuple):
    """Names of the arrays that the steps advance."""

    q: Any
    v: Any
    ground: Any
    energy: Any
    settling: Any


class StepArguments(NamedTuple):
    """Names of the arguments of the exported kernel."""

    bodies: Any
    parameters: Any
    workspace: Any
    state: Any


def digest_sources() -> str:
    """Compute the digest of all sources that the exported code is made of."""
    return hashlib.sha256(b"".join(path.read_bytes() for path in SOURCES)).hexdigest()[:16]


def example_arguments() -> StepArguments:
    """Return arguments of the exported kernel, for their types alone."""
    from archfem.dynamics.rigid_body.simulation import RigidBlockSimulation, prepare_steps
    from archfem.masonry.shapes.rings import circular_arch

    ring = circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=3)
    simulation = RigidBlockSimulation(ring)
    count = len(ring.blocks)
    poses, velocities = np.zeros((2, count, 3))
    state = StepState(poses, velocities, np.zeros((1, 2)), np.zeros(8), np.zeros(4))
    return StepArguments(simulation.bodies, *prepare_steps(simulation, 5e-4), state)


def list_leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield arrays and numbers of nested tuples, with their names, in order."""
    if not isinstance(value, tuple):
        yield path, value
        return
    for name, part in zip(value._fields, value, strict=True):
        yield from list_leaves(part, f"{path}.{name}".lstrip("."))


def write_wrapper(arguments: StepArguments) -> tuple[str, list[Any], dict[str, Any]]:
    """Return source, types and names of a function that rebuilds arguments from their leaves."""
    from numba import carray, types

    parameters, kinds, names = list[str](), list[Any](), dict[str, Any](carray=carray)

    def rebuild(value: Any) -> str:
        if isinstance(value, tuple):
            names[type(value).__name__] = type(value)
            return f"{type(value).__name__}({', '.join(map(rebuild, value))})"
        leaf = f"p{len(parameters)}"
        parameters.append(leaf)
        if not isinstance(value, np.ndarray):
            whole = isinstance(value, int)
            kinds.append(types.int32 if whole else types.float64)
            return f"int({leaf})" if whole else leaf
        kinds.append(types.CPointer(getattr(types, value.dtype.name.replace("bool", "boolean"))))
        sizes = [f"{leaf}_{axis}" for axis in range(value.ndim)]
        parameters.extend(sizes)
        kinds.extend([types.int32] * value.ndim)
        return f"carray({leaf}, ({', '.join(sizes)},))"

    call = ", ".join(map(rebuild, arguments))
    # the deepest overlap, or -1 where there are too many contacts
    source = (
        f"def {EXPORTED}({', '.join(parameters)}):\n    overlap, crowded = kernel({call})\n"
        "    return -1.0 if crowded else overlap\n"
    )
    return source, kinds, names


def compile_code(arguments: StepArguments) -> str:
    """Compile the wrapper of the kernel; return its code, not optimised, for LLVM."""
    import numba

    from archfem.dynamics.rigid_body.time_stepping import advance_steps

    source, kinds, names = write_wrapper(arguments)
    names["kernel"] = advance_steps
    exec(source, names)
    compiled = numba.cfunc(numba.types.float64(*kinds), error_model="numpy")(names[EXPORTED])
    code, wrapper = compiled._library.get_llvm_str(), compiled._wrapper_name
    return re.sub(rf'@"?{re.escape(wrapper)}"?(?=\()', f"@{EXPORTED}", code)


def emit_object(code: str) -> bytes:
    """Optimise code for wasm32, and return the object file."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    triple = "wasm32-unknown-unknown"
    machine = llvm.Target.from_triple(triple).create_target_machine(opt=3, reloc="static")
    code = re.sub(r'target datalayout = ".*"', f'target datalayout = "{machine.target_data}"', code)
    code = re.sub(r'target triple = ".*"', f'target triple = "{triple}"', code)
    # wasm has no common symbols, and no properties of this processor
    code = re.sub(r"= common (local_unnamed_addr )?global", r"= \1global", code)
    code = re.sub(r'"target-(cpu|features)"="[^"]*"', "", code)
    module = llvm.parse_assembly(code)
    module.verify()
    for each in (*module.functions, *module.global_variables):
        if not each.is_declaration and each.name != EXPORTED:
            each.linkage = "internal"
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.slp_vectorization = options.loop_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    return bytes(machine.emit_object(module))


def link(content: bytes) -> bytes:
    """Link an object file with the runtime and a C library."""
    with TemporaryDirectory() as folder:
        path, target = Path(folder) / "kernels.o", Path(folder) / "kernels.wasm"
        path.write_bytes(content)
        exports = [f"-Wl,--export={name}" for name in (EXPORTED, "take")]
        command = [sys.executable, "-m", "ziglang", "cc", "--target=wasm32-wasi", "-Os", "-s"]
        command += ["-mexec-model=reactor", *exports, str(path), str(RUNTIME)]
        subprocess.run([*command, "-o", str(target)], check=True)
        return target.read_bytes()


def main() -> None:
    """Write the kernels, and the names and types of their arguments, stamped with the digest."""
    arguments = example_arguments()
    # that this wrapper and its callees are not stored on disk
    warnings.filterwarnings("ignore", "Cannot cache compiled function")
    content = link(emit_object(compile_code(arguments)))
    kinds = [
        [name, each.dtype.name if isinstance(each, np.ndarray) else "number"]
        for name, each in list_leaves(arguments)
    ]
    WASM.write_bytes(content)
    LAYOUT.write_text(json.dumps({"digest": digest_sources(), "leaves": kinds}) + "\n")
    sys.stdout.write(f"{WASM}: {len(content) / 1e3:.0f} kB\n")


if __name__ == "__main__":
    if "NUMBA_CACHE_DIR" in os.environ:
        main()
    else:  # numba reads its settings when it is imported
        with TemporaryDirectory() as cache:
            environment = os.environ | SETTINGS | {"NUMBA_CACHE_DIR": cache}
            command = [sys.executable, __file__]
            sys.exit(subprocess.run(command, env=environment, check=False).returncode)
