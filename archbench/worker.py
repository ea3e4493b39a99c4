"""Run one adapter on one scene in this process, and write its answer: started by `run.py`.

`python worker.py ADAPTER.py SCENE.json SETTINGS.json ANSWER.json`. The Python is that of the
program's environment, so nothing beyond the standard library is imported here. Adapters find
`scene_tools` beside this file.
"""

import importlib.util
import json
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


def main(adapter: str, scene: str, settings: str, answer: str) -> None:
    """Run an adapter and write its answer, with the processor time of the call alone."""
    module = load(Path(adapter))
    given = json.loads(Path(scene).read_text(encoding="utf-8"))
    chosen = json.loads(Path(settings).read_text(encoding="utf-8"))
    found, cost = timed(module, given, chosen)
    if cost < 1.0:
        # a first call loads modules on demand; of a short run it would be all that is measured
        found, cost = timed(module, given, chosen)
    found["cpu_s"] = cost
    found["version"] = module.version()
    Path(answer).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
