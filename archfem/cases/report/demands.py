"""Demands of an earthquake on a structure: motions, pushes and spectra, with their sources."""

from collections.abc import Iterator

import numpy as np

from archfem.cases.answers import RESULTS
from archfem.cases.push_factors import peak_of_spectrum, site_acceleration
from archfem.cases.report.doubts import MAX_RATIO_OF_PEAKS, peak_of_ground, read_spectrum
from archfem.cases.report.report_data import ReportData
from archfem.masonry.structure import join_words
from archfem.units import STANDARD_GRAVITY, Ends
from archfem.view.pages.document import Grid


def list_demands(data: ReportData) -> Iterator[tuple[str, Ends, str, list[str]]]:
    """Yield each demand of an earthquake: name, peaks [g], source in the case, and results."""
    case, limit = data.case, data.case.limit.demand
    pushes = [RESULTS[name] for name in ("limit", "pushover") if name in data.statements]
    if data.runs:
        # whole motions: the ground of a run ends with it
        up = [x.vertical for x in data.motions.values() if x.vertical is not None]
        vertical = max((np.abs(x).max().item() for x in up), default=0.0) / STANDARD_GRAVITY
        with_vertical = f", with vertical ones of up to {vertical:.2g} g"
        also = with_vertical if vertical else ", without vertical ones"
        peaks, source = map(peak_of_ground, data.runs.values()), "[suite]"
        used = ["time histories, and what varies or scales them"]
        yield f"motions{also}", Ends.of(peaks), source if case.suite else "[motion]", used
    if limit is not None:
        yield "push", Ends.of([limit / STANDARD_GRAVITY]), "[limit]", pushes
        pushes = []
    if np.isfinite(spectrum := peak_of_spectrum(case)):
        source = "[assessment]" if case.assessment.spectrum else "[suite], its target"
        used = [*[RESULTS["assessment"]] * ("assessment" in data.statements), *pushes]
        yield f"{read_spectrum(data)['code']} spectrum", Ends.of([spectrum]), source, used


def tabulate_demands(data: ReportData) -> list[Grid]:
    """Tabulate the demands with their sources; none where the capacities have a single one."""
    found, text = [each for each in list_demands(data) if each[-1]], data.case.report.get("demand")
    compared = "words alone, which are compared with none"
    compared += ": limit.demand is" * (data.case.limit.demand is not None)
    rows = [("as stated", text, "[report]", compared)] if text else []
    rows += [(x, f"{'PGA ' * (x != 'push')}{p:.3g} g", y, join_words(of)) for x, p, y, of in found]
    peaks = [peak for _, ends, *_ in found for peak in ends]
    differ = bool(peaks) and max(peaks) > MAX_RATIO_OF_PEAKS * min(peaks)
    caption = "Demands of an earthquake" + "; a margin on one is none on another" * differ
    head = ("demand", "horizontal", "source in the case", "of which results")
    stated = rows[1:] or (text and data.is_shaken)  # a vehicle has no demand of an earthquake
    return [Grid(head, rows, caption, "words")] if stated else []


def find_demand(data: ReportData) -> float:
    """Return the site's acceleration [g], or the largest peak of the motions; 0 without any."""
    if np.isfinite(site := site_acceleration(data.case)):
        return site
    return max((ends[-1] for _, ends, *_ in list_demands(data)), default=0.0)


def name_spectrum(data: ReportData) -> str:
    """Name the demand of kinematic assessments, with its peak acceleration."""
    code = read_spectrum(data).get("code")
    if code is None:
        return "the spectrum of the motion"
    ground = "above ground " * (code == "floor")
    return f"the {code} spectrum {ground}of PGA {peak_of_spectrum(data.case):.3g} g"
