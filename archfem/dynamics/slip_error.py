"""Error of the slip of joints in time stepping, from the mean resultants of consecutive steps.

A joint slides where its shear V is at the limit μ N. Where sliding begins or ends within a step,
the mean shear differs from that of exact integration. It differs by a share of the curvature of V
in time, or by the variation of the ground's acceleration a within the step. The slip errs in a step
Δt by

    Δs = ½ Δt² c N₀ (ΔV/N - margin),   ΔV/N = max(Δt² |d²(V/N)/dt²| / 6, max |a - mean a| / g).

N₀ is the normal force at rest, and c = 1/m₁ + 1/m₂ the relative acceleration of the two blocks by 1
N. The margin is the distance of V/N from its limit: below it nothing slides.

Where a slide turns within a step without rest, the mean shear is that of a turn in its middle. The
velocity then errs by up to ½ Δt c N₀ |ΔV/N| until it turns or rests again, 1/√3 of that on average.
"""

import numpy as np

from archfem._typing import Array
from archfem.dynamics.state import Batch
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion


def least_compression(rest: Array, structure: Structure) -> Array:
    """Return the least compression to which moments and shears refer: half that at rest [N]."""
    # where all joints start open: a tenth of the mean weight of a block
    floor = 0.1 * structure.weight / len(structure.free)
    least: Array = 0.5 * np.maximum(rest, max(0.5 * np.mean(np.abs(rest)), floor))
    return least


def second_derivatives(times: Array, values: Array) -> Array:
    """Return second derivatives of values at uneven times, each with the two before (n, …)."""
    bends = np.zeros_like(values)
    if len(times) > 2:
        # `np.diff` takes several times as long for the few steps of a batch
        slopes = (values[1:] - values[:-1]) / (times[1:] - times[:-1])[:, None]
        bends[2:] = 2.0 * (slopes[1:] - slopes[:-1]) / (times[2:] - times[:-2])[:, None]
    return bends


class SlipError:
    """Sum of the errors of the slip of rings' and piers' joints over the steps of a run."""

    def __init__(self, structure: Structure, motion: Motion, first: Batch) -> None:
        judged = structure.judged if structure.judged.any() else np.ones_like(structure.judged)
        slides = np.isfinite(structure.friction)
        self.joints = np.flatnonzero(judged & slides)  # numbers of the joints that can slide (j,)
        self.total = np.zeros(len(self.joints))  # sum over the steps added (j,) [m]
        least = least_compression(first.resultants[0, judged, 0], structure)[slides[judged]]
        # cohesion of bonds is lost as they break
        cohesion = np.where(structure.tension > 0.0, 0.0, structure.cohesion)
        self._law = structure.friction[self.joints], cohesion[self.joints], least
        self._gravity = structure.gravity
        # relative acceleration of the two blocks by a shear as large as N at rest (j,) [m/s²]
        masses = np.full(len(structure.blocks), np.inf)
        for number in structure.free:
            block = structure.blocks[number]
            masses[number] = structure.width * block.area * structure.density(block)
        compliance = (1.0 / masses[structure.pairs[self.joints]]).sum(axis=1)
        self._acceleration = 2.0 * least * compliance
        self._motion, self._end = motion, float(first.times[-1])
        rows = [row for row in (motion.horizontal, motion.vertical) if row is not None]
        steepest = sum(np.abs(np.diff(row)).max(initial=0.0) for row in rows)
        self._largest_slope = float(steepest) / motion.dt / structure.gravity  # [g/s]
        # after its last sample a component jumps to zero
        self._jumps = motion.dt * (np.array([len(row) for row in rows]) - 1)
        # times at the middle of the last two steps [s], and their V/N and margins
        self._middles, self._rows = np.zeros(0), np.zeros((0, 2, len(self.joints)))
        self._drift = np.zeros(len(self.joints))  # error of the velocity since the last rest [m/s]
        # lengths, middles, rows and errors of the steps that were estimated last
        self._estimated = tuple(np.zeros((4, 0)))

    def estimate(self, batch: Batch) -> Array:
        """Return the error of the slip in each step that follows those added (steps, j) [m]."""
        lengths = batch.times.copy()
        lengths[0] -= self._end
        lengths[1:] -= batch.times[:-1]
        middles = np.append(self._middles, batch.times - 0.5 * lengths)
        rows, count = np.concatenate([self._rows, self._scale_shears(batch)]), len(lengths)
        squares = np.square(lengths)[:, None]
        variation = squares * np.abs(second_derivatives(middles, rows[:, 0])[-count:]) / 6.0
        # the least margin of a step and the two before
        margins = rows[:, 1].copy()
        for before in (1, 2):
            margins[before:] = np.minimum(margins[before:], rows[:-before, 1])
        margins = np.maximum(margins[-count:], 0.0)
        nearest = margins.min(axis=1, initial=np.inf)
        # elsewhere the ground cannot vary as much within a step as V lacks to its limit
        near = nearest < self._largest_slope * lengths
        for jump in self._jumps:
            near |= (batch.times - lengths <= jump) & (jump <= batch.times)
        if near.any():
            ground = self._vary_ground(batch.times[near], lengths[near])
            variation[near] = np.maximum(variation[near], ground)
        excess = np.maximum(variation - margins, 0.0)
        errors: Array = 0.5 * squares * self._acceleration * excess
        self._estimated = lengths, middles, rows, errors
        return errors

    def add(self, batch: Batch) -> None:
        """Add the first of the steps that were estimated last, all but those cut off since."""
        lengths, middles, rows, errors = self._estimated
        count = len(batch.times)
        end = len(rows) - len(lengths) + count
        self.total = self.total + errors[:count].sum(axis=0)
        self._add_drifts(rows[:end], lengths[:count])
        self._middles, self._rows = middles[max(end - 2, 0) : end], rows[max(end - 2, 0) : end]
        self._end = float(batch.times[-1])

    def _scale_shears(self, batch: Batch) -> Array:
        """Return V/N of the joints, and its distance from the limit (steps, 2, j)."""
        friction, cohesion, least = self._law
        normal, shear = (batch.resultants[:, self.joints, k] for k in range(2))
        pressed, limit = np.maximum(normal, least), friction * np.maximum(normal, 0.0) + cohesion
        return np.stack([shear / pressed, (limit - np.abs(shear)) / pressed], axis=1)

    def _add_drifts(self, rows: Array, lengths: Array) -> None:
        """Add the errors of the slip by those of the velocity, and update these.

        A turn sets the latter: of the last one it leaves (a - μ g)/(a + μ g). A rest removes it.
        """
        # V/N within a thousandth of its limit counts as sliding
        ratio, slides = rows[:, 0], rows[:, 1] < 1e-3
        turns = slides[2:] & slides[:-2] & (ratio[2:] * ratio[:-2] < 0.0)
        rests, lengths = ~(slides[2:] | slides[1:-1]), lengths[len(lengths) - len(turns) :, None]
        turned = self._acceleration * np.abs(ratio[2:] - ratio[:-2]) / np.sqrt(12.0) * lengths
        # each error lasts until the next one
        drifts = np.concatenate([self._drift[None], np.where(turns, turned, 0.0)])
        begins = np.pad(turns | rests, ((1, 0), (0, 0))) * np.arange(len(drifts))[:, None]
        drifts = np.take_along_axis(drifts, np.maximum.accumulate(begins), axis=0)
        self.total = self.total + (lengths * drifts[1:]).sum(axis=0)
        self._drift = drifts[-1]

    def _vary_ground(self, ends: Array, lengths: Array) -> Array:
        """Return by how much the ground's acceleration leaves its mean in steps (k, 1) [g]."""
        count = max(1, int(np.ceil(lengths.max() / self._motion.dt - 1e-9)))
        back = lengths[:, None] * np.linspace(1.0, 0.0, count + 1)
        ground = self._motion.at((ends[:, None] - back).ravel())
        ground = ground.reshape(len(lengths), count + 1, 2)
        mean = 0.5 * (ground[:, 1:] + ground[:, :-1]).mean(axis=1, keepdims=True)
        largest: Array = np.linalg.norm(ground - mean, axis=2).max(axis=1, keepdims=True)
        return largest / self._gravity
