"""Films and pictures of a moving structure, and films of mode shapes."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from tqdm import tqdm

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria
from archfem.limit.mechanism_kinematics import VerifiedMechanism
from archfem.models.model import Model
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.modes import Modes
from archfem.view import joint_marks
from archfem.view.films import frames
from archfem.view.films.encoder import Image, film_path, write_film
from archfem.view.films.frames import Frame, Window
from archfem.view.films.renderer import FrameLayout, FramePainter
from archfem.view.films.settings import Setup, check_film, check_options
from archfem.view.positions import FallingBlocks, fields_at, recorded_fields
from archfem.view.statics import ModePanel, mode_panels


@validate_arguments
def film(  # noqa: PLR0913  (a film has many settings)
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
    renderer: str = "matplotlib",
) -> Path:
    """Write a film of a time history: moving blocks, thrust line, hinges, ground acceleration.

    Displacements are magnified. Blocks are coloured by displacement or by least principal stress.
    A red disc marks a hinge at the face where its blocks stay in contact, a pale one an earlier
    hinge; two opposite arrows mark a sliding joint. The ground acceleration is drawn below the
    structure. Frames are evenly spaced in time: displacements are interpolated linearly between
    the recorded fields, and marks are those of the nearest record. The file is written atomically:
    an interrupted film does not replace an older one.

    In a run with large displacements, the displacements, thrust line and marks are true to scale;
    after blocks have come loose, the film shows their fall to the ground.

    Args:
        model: the model of the run.
        run: a history with recorded fields.
        path: path of the film, .mp4 or .gif; missing folders are created.
        magnification: magnification of displacements [-]; by default a round number that makes them
            visible, and 1 for large displacements. Loose blocks are always true to scale.
        colour: "displacement" or, for deformable blocks, "stress".
        fps: largest number of frames per second; lower if the run has fewer fields.
        seconds: length of the film [s]; by default that of the run.
        size: width and height, even numbers [pixels].
        mechanism: result of `first_verified_mechanism`; from its instant on, the outlines of
            its moving blocks are drawn, displaced by the mechanism.
        window: start and end of slow motion [s], outside of which the film is in real time; "auto"
            for the time around the instant of collapse, or else of the first mechanism by count.
            Slow motion has a tenth of the speed, or more if few fields were recorded.
        renderer: "matplotlib", or "pyvista" to draw blocks and marks by VTK. The latter also writes
            an .html page of up to 60 instants with a slider, to move and enlarge.

    Returns:
        The path of the film.

    Raises:
        InvalidInput: the run has no fields or belongs to another model, or an option is invalid.
        NotInstalled: pyvista cannot be used, or trame is missing for a page.
    """
    page = renderer == "pyvista" and Path(path).suffix == ".html"
    target = Path(path) if page else film_path(path)
    painter = _choose_painter(renderer)
    check_film(model, run, colour, magnification, size)
    falls = FallingBlocks.of(model.structure, run)
    known = recorded_fields(run)[0]
    known = known if falls is None else np.append(known, falls.times[1:])
    timing = frames.frame_timing(run, known, fps, seconds, window)
    held = _times_before_fall(timing.times, falls)
    setup = Setup.of(model, fields_at(run, held), colour, magnification).with_falls(falls)
    if mechanism is not None and mechanism.moved.blocks:
        motion = joint_marks.scale_motion(model.structure, mechanism.motion)
        outlines = joint_marks.outline_moving_blocks(model.structure, motion)
        setup = setup.with_outlines(outlines, mechanism.moved.time or 0.0)
    if page:
        from archfem.view.films.viewer import write_scenes

        shown = _frames(setup, run, _thin(timing.times, setup))
        return write_scenes(target, setup, run, shown)
    layout = FrameLayout(setup, size, run.joints, run, painter)
    drawn = _frames(setup, run, timing.times)
    bar = tqdm(drawn, total=len(timing.times), unit="frame", disable=None, leave=False)
    pairs = zip(bar, timing.speeds, strict=True)
    images = (layout.compose(frame, float(speed)) for frame, speed in pairs)
    return write_film(target, images, timing.fps)


def _thin(times: Array, setup: Setup) -> Array:
    """Return at most 60 of the times: a page holds the blocks of each, and has some 10 MB."""
    most = int(np.clip(100_000 / len(setup.triangles.cell), 5, 60))
    chosen = np.linspace(0, len(times) - 1, min(len(times), most))
    return times[chosen.round().astype(int)]


def _times_before_fall(times: Array, falls: FallingBlocks | None) -> Array:
    """Return the times at which no block is loose."""
    return times if falls is None else times[times < falls.times[0]]


def _frames(setup: Setup, run: History, times: Array) -> Iterator[Frame]:
    """Yield the frames of a run, and of the fall that may follow."""
    held = _times_before_fall(times, setup.falls)
    yield from frames.frames_of_run(setup, run, held, fields_at(run, held))
    if setup.falls is not None:
        yield from frames.frames_of_fall(setup, setup.falls, times[len(held) :])


@validate_arguments
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
    """Draw a single frame of a structure, as in a film.

    Args:
        model: the model.
        q: an equilibrium, or coordinates (n,).
        joints: at that instant, e.g. `run.joints.sel(time=…)`; by default computed by the model
            with its joint memory.
        magnification: magnification of displacements [-]; by default a round number that makes them
            visible.
        colour: "displacement" or, for deformable blocks, "stress".
        size: width and height, even numbers [pixels].
        criteria: failure criteria; by default those of `joints`, or else the default ones.

    Returns:
        The image (height, width, 3), red, green and blue from 0 to 255.

    Raises:
        InvalidInput: q or joints belong to another model, or an option is invalid.
    """
    check_options(model, colour, magnification, size)
    model, q = joint_marks.model_and_coordinates(model, q)
    joints = joint_marks.joints_of_state(model, q, joints, criteria)
    setup = Setup.of(model, q[None], colour, magnification)
    image = FrameLayout(setup, size, joints).compose(frames.frame_of_state(setup, q, joints))
    return image[..., :3].copy()


def _choose_painter(renderer: str) -> type[FramePainter]:
    """Return the painter of a renderer; pyvista is imported only where it is used."""
    if renderer == "matplotlib":
        return FramePainter
    if renderer != "pyvista":
        raise InvalidInput(f"renderer '{renderer}' is not known: use 'matplotlib' or 'pyvista'")
    from archfem.view.films.viewer import ScenePainter

    return ScenePainter


@validate_arguments
def film_modes(
    modes: Modes, path: str | Path, numbers: Sequence[int] | None = None, *, swings: int = 1
) -> Path:
    """Write a film of mode shapes that swing together at one frequency.

    Args:
        modes: result of `modes`.
        path: path of the film, .mp4 or .gif, which repeats; missing folders are created.
        numbers: numbers of the modes, counted from 1; by default all.
        swings: number of swings.

    Returns:
        The path of the film.

    Raises:
        InvalidInput: there is no mode of such a number, or the suffix is not that of a film.
    """
    target = film_path(path)
    figure, panels = mode_panels(modes, numbers)
    return write_film(target, _draw_swings(figure, panels, swings), 20.0)


def _draw_swings(
    figure: Figure, panels: Sequence[ModePanel], swings: int, count: int = 32
) -> Iterator[Image]:
    """Yield the images of several oscillations, cropped to even numbers of pixels."""
    figure.set_dpi(100.0)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    figure.set_layout_engine("none")  # only blocks move, so that the layout need not be repeated
    for turn in np.tile(np.arange(count) / count, swings):
        for panel in panels:
            panel.show_phase(float(np.sin(2.0 * np.pi * turn)))
        canvas.draw()
        image = np.asarray(canvas.buffer_rgba())
        yield image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2, :3].copy()
