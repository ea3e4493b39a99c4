"""Run notebooks and save their outputs: `python docs/execute.py [SCRIPT …]`, `make notebooks`.

The scripts `notebooks/*.py` are the source. Each becomes a notebook of the same name beside it,
with its tables and figures, so that it can be read where nothing is installed. Figures are reduced
to 256 colours, and data that differ between two runs (times, identifiers) are removed.
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

# Notebooks that take many minutes, shipped with the coarse settings and short motions of the tests
QUICK = ("04_from_first_hinge_to_the_ground",)

PICTURES = {
    "03_a_roman_bridge": {
        "bridge": "af.view.draw_instants({name: (case.structure, None)",
        "bridge_dead_load": "af.view.draw_eccentricity(",
        "bridge_stress": "af.view.draw_stress(",
        "bridge_free_body": "af.view.draw_free_body(",
        "bridge_modes": "af.view.draw_modes(",
        "bridge_thrust": "name: (cases[name].structure, each.joints.sel(",
        "bridge_backbones": "af.view.draw_backbones(",
        "bridge_envelopes": "af.view.draw_envelope(paper",
        "bridge_joint": "af.view.draw_joint(paper",
        "bridge_rules": 'af.view.draw_envelope(\n    {"five springs"',
        "bridge_undivided": "af.view.draw_envelope(whole",
    },
}
"""Pictures of notebooks that pages show: file names, and words of the cells that draw them."""

NOTE = """```{note}
The outputs of this notebook were computed with coarse settings (`ARCHFEM_QUICK`), which take half a
minute. Its text describes the results of the full settings, which take many minutes.
```"""


def executed(script: Path, whole: bool) -> nbformat.NotebookNode:
    """Run the notebook of a script in a fresh kernel, outside of the checkout."""
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
    """Reduce a base64 picture to 256 colours."""
    picture = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    kept = io.BytesIO()
    picture.quantize(256, dither=Image.Dither.NONE).save(kept, "PNG", optimize=True)
    return base64.b64encode(kept.getvalue()).decode()


def cleaned(notebook: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Remove data that differ between runs, and reduce the figures."""
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


def pictures(notebook: nbformat.NotebookNode, name: str) -> dict[str, bytes]:
    """Return the PNG files that pages show, by name, from the outputs of a notebook."""
    found = {}
    for file, words in PICTURES.get(name, {}).items():
        (cell,) = (each for each in notebook.cells if words in each.source)
        shown = [o.data["image/png"] for o in cell.outputs if "image/png" in o.get("data", {})]
        found[file] = base64.b64decode(shown[-1])
    return found


def main(words: list[str]) -> None:
    """Run the named scripts, or all; `--whole` uses full settings. Print the cost of each."""
    scripts = [word for word in words if word != "--whole"]
    for script in map(Path, scripts or sorted(FOLDER.glob("*.py"))):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        kept = script.with_suffix(".ipynb")
        notebook = cleaned(executed(script, "--whole" in words))
        nbformat.write(notebook, kept)
        for name, png in pictures(notebook, script.stem).items():
            (FOLDER / "figures" / f"{name}.png").write_bytes(png)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime
        print(f"{kept.name}: {cpu:.0f} s of CPU, {kept.stat().st_size / 1e3:.0f} kB", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
