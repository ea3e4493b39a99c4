"""Answer one scene by one adapter, once for each line on standard input: started by `run.py`.

`python worker.py ADAPTER.py SCENE.json`, and lines of JSON with "settings" and the path "answer".
The Python is that of the program's environment, so nothing beyond the standard library is imported
here. Adapters find `scene_tools` beside this file.
"""

import importlib.util
import json
import os
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any


def load(path: Path) -> ModuleType:
    """Import an adapter by its path."""
    if (here := str(Path(__file__).parent)) not in sys.path:
        sys.path.append(here)
    spec = importlib.util.spec_from_file_location(f"adapter_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def timed(module: ModuleType, scene: Any, settings: Any) -> tuple[dict[str, Any], float]:
    """Return an answer and its processor time [s]."""
    start = time.process_time()
    found = module.run(scene, settings)
    return found, time.process_time() - start


def main(adapter: str, scene: str, short: float = 5.0) -> None:
    """Answer until the input ends; a short first call [s] is repeated, and the repetition timed."""
    module = load(Path(adapter))
    given = json.loads(Path(scene).read_text(encoding="utf-8"))
    for number, line in enumerate(sys.stdin):
        request = json.loads(line)
        found, cost = timed(module, given, request["settings"])
        if number == 0 and cost < short:
            # modules and compiled kernels are loaded on first use, which is no cost of the answer
            found, cost = timed(module, given, request["settings"])
        found |= {"cpu_s": cost, "version": module.version()}
        # complete once it is there under its name
        unfinished = Path(f"{request['answer']}.part")
        unfinished.write_text(json.dumps(found), encoding="utf-8")
        os.replace(unfinished, request["answer"])


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
