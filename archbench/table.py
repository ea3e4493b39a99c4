"""Table of answers beside references, written into the documentation: `python -m archbench.table`.

A cell is the answer over its reference, the range over settings that are not physics, and the
processor time over that of archfem. Measured rows come first.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from archbench.programs import NO_ACTION
from archbench.run import RESULTS, results_of
from archbench.scene import HERE, Reference, read_references, read_scene, scene_names

ROOT = HERE.parent

PROGRAMS = ("archfem", "hybridfem", "lmgc90", "opensees", "rbe", "siconos")

# Kinds of references, the strongest first
ORDER = ("E", "A", "P", "")


@dataclass(frozen=True)
class Row:
    """A quantity of a scene, its reference, and the answers of all programs.

    Attributes:
        scene: name of the scene.
        title: of the scene.
        quantity: in question.
        unit: of the quantity.
        references: values of the strongest kind, one or several.
        answers: stored answers by program.
        from_memory: parts of the scene's geometry that were not read in a source.
        is_bridge: whether settings are what nobody measured of a bridge: then an answer is a range.
    """

    scene: str
    title: str
    quantity: str
    unit: str
    references: tuple[Reference, ...]
    answers: dict[str, dict[str, Any]]
    from_memory: tuple[str, ...] = ()
    is_bridge: bool = False

    @property
    def kind(self) -> str:
        """Kind of the references; empty where there is none."""
        return self.references[0].kind if self.references else ""

    @property
    def grade(self) -> str:
        """Grade of the weakest of them."""
        return max((value.grade for value in self.references), default="")

    @property
    def reference(self) -> tuple[float, float]:
        """Middle of the references and half of their range, uncertainties included."""
        low = min(value.number - value.uncertainty for value in self.references)
        high = max(value.number + value.uncertainty for value in self.references)
        return 0.5 * (low + high), 0.5 * (high - low)

    def numbers(self, program: str) -> list[float]:
        """Return the answers of a program over its settings, variants left out."""
        runs = self.answers.get(program, {}).get("runs", [])
        return [
            run["values"][self.quantity]
            for run in runs
            if "variant" not in run["settings"]
            and "failed" not in run
            and self.quantity in run["values"]
        ]

    def ratio(self, program: str) -> float | None:
        """Return the answer over the reference; None without one of both."""
        numbers = self.numbers(program)
        return numbers[0] / self.reference[0] if numbers and self.references else None

    def is_inside(self, program: str) -> bool | None:
        """Return whether the answer, of a bridge its range, meets that of the reference."""
        numbers = self.numbers(program)
        if not numbers or not self.references:
            return None
        middle, half = self.reference
        if self.is_bridge:
            return min(numbers) <= middle + half and max(numbers) >= middle - half
        return abs(numbers[0] - middle) <= half * (1.0 + 1e-9)

    def cost(self, program: str) -> float | None:
        """Return the processor time over that of archfem, medians of runs in turn."""
        times = self.answers.get(program, {}).get("cost", {})
        if not times.get("own"):
            return None
        # a run shorter than the clock's step has no ratio
        return median(times["own"]) / median(times["archfem"]) if all(times["archfem"]) else None


def rows(results: Path = RESULTS) -> list[Row]:
    """Return all rows, measured ones first."""
    stored = {program: results_of(program, results) for program in PROGRAMS}
    found = [row for name in scene_names() for row in _rows_of(name, stored)]
    return sorted(found, key=lambda row: ORDER.index(row.kind))


def _rows_of(name: str, stored: dict[str, dict[str, Any]]) -> Iterator[Row]:
    """Yield the rows of a scene."""
    scene, references = read_scene(name), read_references(name)
    answers = {program: found[name] for program, found in stored.items() if name in found}
    for quantity, about in scene["quantities"].items():
        values = [value for value in references if value.quantity == quantity]
        best = next((k for k in ORDER if any(value.kind == k for value in values)), "")
        chosen = tuple(value for value in values if value.kind == best)
        # of several grades, those that were read count
        read = tuple(value for value in chosen if value.grade != "m") or chosen
        memory = tuple(scene.get("from_memory", ()))
        bridge = scene["action"].get("fill") is not None
        yield Row(name, scene["title"], quantity, about["unit"], read, answers, memory, bridge)


def number(value: float) -> str:
    """Return a number of four digits."""
    return f"{value:.4g}"


def rounded(value: float) -> str:
    """Return an uncertainty of one digit."""
    return f"{float(f'{value:.1g}'):g}"


def cell(row: Row, program: str) -> str:
    """Return the cell of a program: ratio, range, cost, or why there is none."""
    answer = row.answers.get(program)
    if answer is None:
        return ""
    if "cannot" in answer:
        return "cannot"
    numbers = row.numbers(program)
    if not numbers:
        # a program may answer one quantity of a scene and not another
        failed = any("failed" in run for run in answer["runs"])
        return "failed" if failed else "cannot"
    scale = row.reference[0] if row.references else 1.0
    digits = ".2f" if row.kind == "E" else ".3f"
    shown = [
        format(value / scale, digits) if row.references else number(value) for value in numbers
    ]
    low, high = shown[numbers.index(min(numbers))], shown[numbers.index(max(numbers))]
    text = shown[0] if low == high else f"{shown[0]} ({low}–{high})"
    cost = row.cost(program)
    times = f", {float(f'{cost:.2g}'):g}×" if cost else ""
    outside = row.is_inside(program) is False
    return f"{text}{' ◦' if outside else ''}{times}"


def marked(name: str, row: Row) -> str:
    """Return a name, marked where lengths of the scene are from memory."""
    return f"{name} **g**" if row.from_memory else name


def known_programs(found: Sequence[Row]) -> list[str]:
    """Return the programs with stored answers."""
    return [name for name in PROGRAMS if any(name in row.answers for row in found)]


def markdown(found: Sequence[Row], programs: Sequence[str]) -> str:
    """Return rows as a Markdown table."""
    head = ["scene", "quantity", "reference", *programs]
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for row in found:
        reference = "none"
        if row.references:
            middle, half = row.reference
            mark = " **m**" if row.grade == "m" else ""
            reference = f"{row.kind} {number(middle)} ± {rounded(half)}{mark}"
        unit = "" if row.unit == "-" else f" [{row.unit}]"
        cells = [cell(row, program) for program in programs]
        name = marked(f"{row.scene}, {row.title}", row)
        lines.append(f"| {' | '.join([name, row.quantity + unit, reference, *cells])} |")
    return "\n".join(lines)


# Rows of the front page by scene and quantity, with what decides the answer
HEAD = {
    ("S32_040", "monotonic"): "stability: it rocks about its toe",
    ("S32_100", "cyclic"): "stability",
    ("S32_175", "cyclic"): "stability",
    ("S32_250", "cyclic"): "stability; its toe also crushed",
    ("S33", "at 0.08"): "stiffness of the joints, at the peak",
    ("S33", "at 0.36"): "geometry of the moved wall",
    ("S13_3", "ratio"): "loss at an impact, an input: rigid impacts lose too little",
    ("S20", "load"): "fill, thickness, cover; as a plastic fill it is the upper end",
    ("S30", "load"): "bond of the mortar, left out here",
    ("S05", "peak"): "points of contact a joint, 3DEC's rule",
    ("S08_050", "scale"): "impacts and joints; three programs differ by as much",
}


def head(found: Sequence[Row]) -> str:
    """Return rows that matter most to readers, short."""
    lines = [
        "| test or program (**g**: lengths from memory) | reference | archfem | what decides |"
    ]
    lines.append("|---|---|---|---|")
    chosen = {(row.scene, row.quantity): row for row in found}
    for (scene, quantity), why in HEAD.items():
        if (row := chosen.get((scene, quantity))) is not None:
            title = marked(f"{row.title.split(',')[0]}, {quantity}", row)
            lines.append(f"| {title} | {measure(row)} | {cell(row, 'archfem')} | {why} |")
    return "\n".join(lines)


def measure(row: Row) -> str:
    """Return the reference of a row with its unit."""
    middle, half = row.reference
    unit = "" if row.unit == "-" else f" {row.unit}"
    return f"{number(middle)} ± {rounded(half)}{unit}"


def scores(found: Sequence[Row], programs: Sequence[str]) -> str:
    """Return the share of rows inside their uncertainty, with their number, as a table."""
    measured = [row for row in found if row.kind == "E"]
    read = [row for row in measured if row.grade != "m"]
    groups = {
        "measured, source read": [r for r in read if not r.from_memory],
        "the same, lengths of the scene from memory": [r for r in read if r.from_memory],
        "measured, from memory": [r for r in measured if r.grade == "m"],
        "closed form": [r for r in found if r.kind == "A"],
        "other programs": [r for r in found if r.kind == "P"],
    }
    lines = [
        f"| inside the uncertainty | {' | '.join(programs)} |",
        f"|---|{'---|' * len(programs)}",
    ]
    for name, group in groups.items():
        cells = []
        for program in programs:
            inside = [row.is_inside(program) for row in group]
            answered = [each for each in inside if each is not None]
            cells.append(f"{sum(answered)} of {len(answered)}" if answered else "–")
        lines.append(f"| {name}, {len(group)} rows | {' | '.join(cells)} |")
    return "\n".join(lines)


def refusals(found: Sequence[Row], programs: Sequence[str]) -> str:
    """Return why programs have no answer, and which runs failed, as a list."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for row in found:
        for program in programs:
            answer = row.answers.get(program, {})
            # "no action": listed once for each program
            why = [f"cannot: {answer['cannot']}"] if "cannot" in answer else []
            why = [each for each in why if NO_ACTION not in each]
            why += [
                f"failed: {run['failed']} ({run['settings']})"
                for run in answer.get("runs", ())
                if "failed" in run
            ]
            for each in why:
                names = reasons.setdefault((program, each), [])
                names += [] if row.scene in names else [row.scene]
    lines = [f"- {program}, {', '.join(names)}: {why}" for (program, why), names in reasons.items()]
    for program in programs:
        refused = [
            row.answers[program]["cannot"].split("'")[1]
            for row in found
            if NO_ACTION in row.answers.get(program, {}).get("cannot", "")
        ]
        if refused:
            lines.append(f"- {program}: {NO_ACTION} {', '.join(sorted(set(refused)))}")
    return "\n".join(lines)


def variants(found: Sequence[Row]) -> str:
    """Return archfem's answers by other laws of joints, as a table."""
    names = ("exact", "two points", "rigid")
    lines = [
        f"| scene | quantity | as the scene says | {' | '.join(names)} |",
        f"|---|---|---|{'---|' * len(names)}",
    ]
    for row in found:
        runs = row.answers.get("archfem", {}).get("runs", [])
        others = {run["settings"].get("variant"): run for run in runs}
        if "exact" not in others:
            continue
        cells = [
            number(others[name]["values"][row.quantity])
            if "failed" not in others[name]
            else "failed"
            for name in names
        ]
        first = number(row.numbers("archfem")[0]) if row.numbers("archfem") else "failed"
        lines.append(
            f"| {row.scene} | {row.quantity} [{row.unit}] | {first} | {' | '.join(cells)} |"
        )
    return "\n".join(lines)


def bridges(found: Sequence[Row]) -> str:
    """Return archfem's loads of bridges over the tests, and what decides them, as a table."""
    changes: dict[str, Callable[[dict[str, Any]], bool]] = {
        "m 0 to 1, c to 7 kPa": lambda s: "cohesion" in s and not s.get("plastic"),
        "thickness ± 10 %": lambda s: "thickness" in s,
        "cover ± 0.1 m": lambda s: "cover" in s,
        "half the strength": lambda s: "strength" in s,
        "no crushing": lambda s: s.get("variant") == "no crushing",
    }
    head = ["bridge", "test [kN]", "default fill", "plastic fill", *changes]
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for row in found:
        if not row.is_bridge or "archfem" not in row.answers:
            continue
        runs = [run for run in row.answers["archfem"]["runs"] if "failed" not in run]
        middle = row.reference[0]

        def over(chosen: list[dict[str, Any]], middle: float = middle) -> str:
            loads = [run.get("brackets", {}).get("load", [run["values"]["load"]]) for run in chosen]
            parts = sorted(f"{load / middle:.2f}" for each in loads for load in each)
            return "–".join(dict.fromkeys((parts[0], parts[-1]))) if parts else "failed"

        plastic = [run for run in runs if run["settings"].get("plastic")]
        cells = [f"**{over(runs[:1])}**", f"**{over(plastic)}**"]
        cells += [over([run for run in runs if of(run["settings"])]) for of in changes.values()]
        mark = " **m**" if row.grade == "m" else ""
        name = marked(row.title.split(",")[0], row)
        lines.append(f"| {name} | {number(middle)}{mark} | {' | '.join(cells)} |")
    return "\n".join(lines)


def sources(found: Sequence[Row]) -> str:
    """Return the references by source, and lengths of scenes from memory, as a list."""
    cited: dict[str, list[str]] = {}
    memory: dict[str, list[str]] = {}
    for row in found:
        # those of weaker kinds too, which are in no ratio
        values = [v for v in read_references(row.scene) if v.quantity == row.quantity]
        for value in values:
            read = value.read_by or "from memory"
            place = value.url if not value.url.startswith("http") else f"<{value.url}>"
            note = f" ({value.note})" if value.note else ""
            measure = f"{number(value.number)} ± {rounded(value.uncertainty)}"
            text = f"{row.scene} {row.quantity} {measure}, {value.kind}{value.grade}{note}"
            source = "; ".join(part for part in (f"{value.source}. {place}".strip(), read) if part)
            cited.setdefault(source, []).append(text)
        if row.from_memory:
            memory[row.scene] = list(row.from_memory)
    lines = [f"- {source}: {'; '.join(dict.fromkeys(each))}." for source, each in cited.items()]
    if memory:
        known = "; ".join(f"{scene}: {', '.join(parts)}" for scene, parts in memory.items())
        lines.append(f"- From memory: {known}.")
    return "\n".join(lines)


def versions(found: Sequence[Row], programs: Sequence[str]) -> str:
    """Return the versions of the programs that answered."""
    names = {
        run["version"]
        for row in found
        for program in programs
        for run in row.answers.get(program, {}).get("runs", ())
        if "version" in run
    }
    return ", ".join(sorted(names))


def sections(found: Sequence[Row]) -> dict[str, str]:
    """Return the made parts of the documentation by name."""
    programs = known_programs(found)
    return {
        "table": markdown(found, programs),
        "scores": scores(found, programs),
        "refusals": refusals(found, programs),
        "variants": variants(found),
        "bridges": bridges(found),
        "sources": sources(found),
        "versions": versions(found, programs),
        "head": head(found),
    }


def with_sections(text: str, made: dict[str, str]) -> str:
    """Return a page with its marked parts replaced by the generated text."""

    def replaced(match: re.Match[str]) -> str:
        name = match.group(1)
        return f"<!-- {name} -->\n{made[name]}\n<!-- end -->"

    return re.sub(r"<!-- (\w+) -->\n.*?<!-- end -->", replaced, text, flags=re.DOTALL)


PAGES = (ROOT / "archbench/ANSWERS.md", ROOT / "README.md")


def main() -> None:
    """Write the made parts into the pages."""
    made = sections(rows())
    for page in PAGES:
        page.write_text(with_sections(page.read_text(encoding="utf-8"), made), encoding="utf-8")
    print(made["scores"])


if __name__ == "__main__":
    main()
