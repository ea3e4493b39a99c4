"""Run notebooks and keep what they show: `python docs/execute.py [SCRIPT …]`, `make notebooks`.

The scripts `notebooks/*.py` are the source. Each becomes a notebook of the same name beside it,
with its tables and pictures in it, so that it can be read where nothing is installed. Pictures are
reduced to 256 colours, and what differs between two runs (times, identifiers) is left out.
"""

import base64
import io
import os
import resource
import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient
from PIL import Image

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"

QUICK = ("06_a_roman_bridge", "07_from_first_hinge_to_the_ground")
"""What takes many minutes, and is shipped as it runs in tests: coarse, and on short motions."""

NOTE = """```{note}
What this notebook shows was computed on coarse settings (`ARCHFEM_QUICK`), to be run in half a
minute. Its words tell of the whole settings, which take it many minutes.
```"""


def executed(script: Path, whole: bool) -> nbformat.NotebookNode:
    """The notebook of a script, run from the start in a fresh kernel, outside of the checkout."""
    notebook = jupytext.read(script)
    if script.stem in QUICK and not whole:
        notebook.cells.insert(1, nbformat.v4.new_markdown_cell(NOTE))
        os.environ["ARCHFEM_QUICK"] = "1"
    else:
        os.environ.pop("ARCHFEM_QUICK", None)
    client = NotebookClient(
        notebook,
        timeout=None,
        kernel_name="python3",
        record_timing=False,
        resources={"metadata": {"path": os.environ.get("TMPDIR", "/tmp")}},
    )
    client.execute()
    return notebook


def smaller(png: str) -> str:
    """A picture in base64, in 256 colours."""
    picture = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    kept = io.BytesIO()
    picture.quantize(256, dither=Image.Dither.NONE).save(kept, "PNG", optimize=True)
    return base64.b64encode(kept.getvalue()).decode()


def cleaned(notebook: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """The notebook without what differs between runs, its pictures reduced."""
    notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"]}
    for number, cell in enumerate(notebook.cells):
        cell.id, cell.metadata = f"cell-{number}", {}
        shown = [o for o in cell.get("outputs", []) if o.get("name") != "stderr"]
        for output in shown:
            data = output.get("data", {})
            if "image/png" in data:
                data["image/png"] = smaller(data["image/png"])
                data["text/plain"] = "picture"
            output.pop("metadata", None) if output.output_type == "stream" else None
            if "metadata" in output:
                output.metadata = {}
        if "outputs" in cell:
            cell.outputs = shown
    return notebook


def main(words: list[str]) -> None:
    """Run the scripts that are named, or all; `--whole` makes none quick. Say what each cost."""
    scripts = [word for word in words if word != "--whole"]
    for script in map(Path, scripts or sorted(FOLDER.glob("*.py"))):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        kept = script.with_suffix(".ipynb")
        nbformat.write(cleaned(executed(script, "--whole" in words)), kept)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime
        print(f"{kept.name}: {cpu:.0f} s of CPU, {kept.stat().st_size / 1e3:.0f} kB", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
