"""Films and stills of a structure that moves: how hinges form.

Films of vibration shapes.
"""

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from tqdm import tqdm

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria
from archfem.limit.mechanism_kinematics import VerifiedMechanism
from archfem.models.model import Model
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.modes import Modes
from archfem.view.films.encoder import Image, film_path, write_film
from archfem.view.films.frames import FrameTiming, Window, falling, moving, pace_of, still
from archfem.view.films.renderer import FrameLayout
from archfem.view.films.settings import Setup, check_colour
from archfem.view.joint_marks import displaced, drawn, joints_at, swung
from archfem.view.positions import FallingBlocks, fields_at, kept_fields
from archfem.view.statics import Panel, mode_panels

# Least width and height of a picture [pixels]: type would not fit into less
SMALLEST = (480, 320)


def film(  # noqa: PLR0913  (what is filmed, and how)
    model: Model,
    run: History,
    path: str | Path,
    *,
    magnification: float | None = None,
    colour: str = "displacement",
    fps: float = 20.0,
    seconds: float | None = None,
    size: tuple[int, int] = (1280, 720),
    mechanism: VerifiedMechanism | None = None,
    window: Window = None,
) -> Path:
    """Film a time history: blocks move, the thrust line wanders, hinges come and go.

    Displacements are magnified. Blocks are coloured by displacement or by least principal
    stress. A red disc marks a hinge on the face where its blocks stay in contact, and leaves a
    faint trace; two opposite arrows mark a joint that slides. Below runs the acceleration of the
    ground. Frames follow one another at even times, whatever the steps: displacements run straight
    between the fields that were kept, and marks are those of the nearest record. The film is
    written in one stroke: a killed one leaves the old file or none.

    Where displacements may be large they are shown as they are, thrust line and marks where the
    faces have gone; once blocks came loose, the film follows them to the ground.

    Args:
        model: that made the run.
        run: with fields.
        path: the film, .mp4 or .gif; folders are made.
        magnification: of displacements [-]; by default a round number that shows them well, and 1
            where they may be large. What falls is always shown as it is.
        colour: "displacement" or, for blocks that are not rigid, "stress".
        fps: frames a second, at most; fewer where the run has fewer fields.
        seconds: how long the film lasts [s]; by default as long as the run.
        size: width and height, even numbers [pixels].
        mechanism: as found by `first_verified_mechanism`: from its instant on, the outlines of the
            blocks that it moves are drawn where it takes them.
        window: from when until when the film is in slow motion [s], and in real time else; "auto"
            for around the instant in which blocks come loose, or else the first mechanism by
            count. Slow motion is a tenth of the speed, or faster where few fields were kept.

    Returns:
        The film's path.

    Raises:
        InvalidInput: the run has no fields or is another model's, or an option cannot be meant.
    """
    target = film_path(path)
    check_film(model, run, colour, magnification, size)
    falls = FallingBlocks.of(model.structure, run)
    known = kept_fields(run)[0]
    known = known if falls is None else np.append(known, falls.times[1:])
    pace = pace_of(run, falls, known, fps, seconds, window)
    held = pace.times if falls is None else pace.times[pace.times < falls.times[0]]
    setup = Setup.of(model, fields_at(run, held), colour, magnification).with_falls(falls)
    shots = _shots(_with(setup, mechanism), run, pace, falls, size)
    return write_film(target, shots, pace.fps)


def picture(
    model: Model,
    q: Equilibrium | Array,
    *,
    joints: xr.Dataset | None = None,
    magnification: float | None = None,
    colour: str = "displacement",
    size: tuple[int, int] = (1280, 720),
    criteria: Criteria | None = None,
) -> Image:
    """Take one picture of a structure at rest or in motion.

    Args:
        model: what stands.
        q: an equilibrium, or coordinates (n,).
        joints: at that instant, e.g. `run.joints.sel(time=…)`; by default as the model has them,
            with what they remember.
        magnification: of displacements [-]; by default a round number that shows them well.
        colour: "displacement" or, for blocks that are not rigid, "stress".
        size: width and height, even numbers [pixels].
        criteria: what makes a joint fail; by default those of `joints`, or else the usual ones.

    Returns:
        The picture (height, width, 3), red, green and blue from 0 to 255.

    Raises:
        InvalidInput: q or joints are another model's, or an option cannot be meant.
    """
    _check_picture(model, colour, magnification, size)
    model, q = drawn(model, q)
    joints = joints_at(model, q, joints, criteria)
    setup = Setup.of(model, q[None], colour, magnification)
    return FrameLayout(setup, size).compose(still(setup, q, joints))[..., :3].copy()


def check_film(
    model: Model,
    run: History,
    colour: str,
    magnification: float | None,
    size: tuple[int, int] = SMALLEST,
) -> None:
    """Refuse what cannot be shown moving."""
    _check_picture(model, colour, magnification, size)
    _check_run(model, run)


def _with(setup: Setup, mechanism: VerifiedMechanism | None) -> Setup:
    """Let a mechanism be seen from its instant on."""
    if mechanism is None or not mechanism.moved.blocks:
        return setup
    structure = setup.model.structure
    outlines = displaced(structure, swung(structure, mechanism.motion))
    return setup.with_outlines(outlines, mechanism.moved.time or 0.0)


def _shots(
    setup: Setup,
    run: History,
    pace: FrameTiming,
    falls: FallingBlocks | None,
    size: tuple[int, int],
) -> Iterator[Image]:
    """Yield the frames of a film; a bar shows progress."""
    times = pace.times
    page, held = FrameLayout(setup, size, run), times
    if falls is not None:
        held, loose = times[times < falls.times[0]], times[times >= falls.times[0]]
    shown = moving(setup, run, held, fields_at(run, held))
    if falls is not None:
        shown = chain(shown, falling(setup, falls, loose))
    bar = tqdm(shown, total=len(times), unit="frame", disable=None, leave=False)
    for shot, speed in zip(bar, pace.speeds, strict=True):
        yield page.compose(shot, float(speed))


def _check_picture(
    model: Model, colour: str, magnification: float | None, size: tuple[int, int]
) -> None:
    """Refuse what cannot be drawn."""
    check_colour(model.cells, colour)
    if magnification is not None and not 0.0 < magnification < 1e12:
        raise InvalidInput(f"magnification {magnification:.4g} is not above 0")
    if len(size) != 2 or any(n % 2 or n < least for n, least in zip(size, SMALLEST, strict=True)):
        raise InvalidInput(
            f"size {size}: give an even width and height of at least {SMALLEST} pixels"
        )


def _check_run(model: Model, run: History) -> None:
    """A run must have fields, and they must be the model's."""
    if "q" not in run.dataset:
        raise InvalidInput(
            "the run has no fields to draw: record them with "
            "time_history(..., record=Record(fields_every=10))"
        )
    _check_size(model, run.dataset.sizes["coordinate"])


def _check_size(model: Model, size: int) -> None:
    """Coordinates must be as many as the model has."""
    if size != model.size:
        raise InvalidInput(
            f"there are {size} coordinates, and the model has {model.size}: give the model, of the "
            "same cells and degree, that they were computed with"
        )


# Pictures of one swing, and how many of them a second shows
FRAMES = 32


def film_modes(
    modes: Modes, path: str | Path, numbers: Sequence[int] | None = None, *, swings: int = 1
) -> Path:
    """Film vibration shapes, each panel swinging once in the same time, whatever its period.

    Args:
        modes: as found by `modes`.
        path: the film, .mp4 or .gif, which repeats itself; folders are made.
        numbers: which of them, counted from 1; by default all.
        swings: how often they swing.

    Returns:
        The film's path.

    Raises:
        InvalidInput: a number is not among them, or the suffix is not that of a film.
    """
    target = film_path(path)
    figure, panels = mode_panels(modes, numbers)
    # pictures of one swing, and how many of them a second shows
    return write_film(target, _shots_modes(figure, panels, swings), 20.0)


def _shots_modes(figure: Figure, panels: Sequence[Panel], swings: int) -> Iterator[Image]:
    """Yield the pictures of some swings (height, width, 3), of even numbers of pixels."""
    # of a film [dots per inch]
    figure.set_dpi(100.0)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    figure.set_layout_engine("none")  # nothing on the page will move but the blocks
    for turn in np.tile(np.arange(FRAMES) / FRAMES, swings):
        for panel in panels:
            panel.swing(float(np.sin(2.0 * np.pi * turn)))
        canvas.draw()
        page = np.asarray(canvas.buffer_rgba())
        yield page[: page.shape[0] // 2 * 2, : page.shape[1] // 2 * 2, :3].copy()
