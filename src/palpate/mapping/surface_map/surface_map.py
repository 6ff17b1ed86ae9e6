"""The map of a touched surface, updated contact by contact."""

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
from scipy.spatial import KDTree

from palpate.compiling import njit
from palpate.errors import FloatArray, InvalidValueError, numbers
from palpate.estimation import BrokenAssumption, Verdict
from palpate.mapping.cloud import TouchCloud
from palpate.mapping.surface_map.agreement import Agreement
from palpate.mapping.surface_map.blend import Blend, IndexArray, PatchEstimate, blended, patch_estimates
from palpate.mapping.surface_map.estimate import Knowledge, SurfaceEstimate
from palpate.mapping.surface_map.learn import Parameter, at_bounds, learn
from palpate.mapping.surface_map.model import SurfaceModel
from palpate.mapping.surface_map.patch import STEEPEST_COS, PatchData, PatchFrame, SurfacePatch
from palpate.mapping.surface_map.resolution import WIDENED, facet_height, finer_than_rows
from palpate.mapping.surface_map.settings import MapSettings
from palpate.mapping.surface_map.spikes import BoolArray, left_out, spikes
from palpate.mapping.surface_map.stretches import PathContacts, Stretches, cut
from palpate.mapping.surface_map.surrounded import surrounded


def seeds(
    position: FloatArray,
    normal: FloatArray,
    centers: FloatArray,
    axes: FloatArray,
    spacing: float,
    least_cos: float,
) -> IndexArray:
    """Return the stretches that start a patch, increasing, shape (k,).

    Args:
        position: Of new stretches, in path order, shape (n, 3) [m].
        normal: Theirs, shape (n, 3).
        centers: Of the patches there are, shape (p, 3) [m].
        axes: Theirs, shape (p, 3).
        spacing: A patch is near whose centre is not farther [m].
        least_cos: And whose axis is turned from the normal by an angle of a larger cosine.
    """
    return _seeds(np.hstack([position, normal]), np.hstack([centers, axes]), spacing, least_cos)


@njit(cache=True)
def _seeds(new: FloatArray, patches: FloatArray, spacing: float, least_cos: float) -> IndexArray:
    """Rows are places and directions."""
    before = len(patches)
    started = np.empty(len(new), np.intp)
    count = 0
    for i in range(len(new)):
        alone = True
        for j in range(before + count):
            other = patches[j] if j < before else new[started[j - before]]
            square = cos = 0.0
            for k in range(3):
                step = new[i, k] - other[k]
                square += step * step
                cos += new[i, 3 + k] * other[3 + k]
            if square <= spacing * spacing and cos > least_cos:
                alone = False
                break
        if alone:
            started[count] = i
            count += 1
    return started[:count]


SEED_COS = 0.82
"""A contact whose normal leans more than 35 degrees from the axes of all patches near it starts its own: patches
see 60 degrees, so that neighbours overlap around a bend."""

NEAREST_STEPS = 3
"""Steps to the nearest point: each leaves a fraction of distance times curvature squared."""

SEARCH_REACHES = 1.5
"""Contacts up to 1.5 reaches away tell on which sides of a point something was felt. From the middle between rows
2 reaches apart, the widest that are observed, they show 96 degrees of either; farther ones would bridge holes."""


BEFORE = 2
"""Contacts before a stretch that tell whether its first ones are outliers."""


class SurfaceMap:
    """A Gaussian-process surface in overlapping patches, which grows with every batch of contacts.

    Adding two batches is the same as adding their sum; only patches within reach of what is new are fitted again.
    """

    def __init__(self, settings: MapSettings | None = None, model: SurfaceModel | None = None) -> None:
        """Begin a map without contacts.

        Args:
            settings: How it is made; None: the usual ones.
            model: What it believes, if another map has learned it; None: that of the settings.
        """
        self._settings = settings or MapSettings()
        self._model = model or self._settings.model
        self._stretches = Stretches.none()
        self._open: PathContacts | None = None
        self._before = 0  # contacts of `_open` that are there only to judge the others by
        self._open_patches = 0  # patches that the open stretch has started
        self._outliers = np.zeros((0, 3))
        self._open_outliers = 0
        self._felt = 0  # contacts
        self._frames: list[PatchFrame] = []
        self._patches: list[SurfacePatch] = []
        self._members: list[IndexArray] = []
        self._centers = np.zeros((0, 3))
        self._axes = np.zeros((0, 3))
        self._tree: KDTree | None = None
        self._agreement = Agreement()
        self._factor = self._agreement.factor

    @classmethod
    def learned(cls, cloud: TouchCloud, settings: MapSettings | None = None) -> "SurfaceMap":
        """Return the map of `cloud` with noise and surface learned from it."""
        made = cls(settings)
        made._take_in(cloud)
        made.relearn()
        return made

    def __len__(self) -> int:
        """Number of stretches, means over short pieces of path, that the map holds."""
        return len(self._stretches)

    @property
    def settings(self) -> MapSettings:
        """What it was built with."""
        return self._settings

    @property
    def model(self) -> SurfaceModel:
        """What it believes about surface and noise now: that of the settings until `relearn`."""
        return self._model

    @property
    def stretches(self) -> Stretches:
        """What was felt, as means over short pieces of path."""
        return self._stretches

    @property
    def patches(self) -> tuple[SurfacePatch, ...]:
        """The patches, in the order in which the finger came by."""
        return tuple(self._patches)

    @property
    def outliers(self) -> FloatArray:
        """Contacts that were left out, far off what their neighbours along the path say, shape (k, 3) [m]."""
        return self._outliers

    @property
    def verdict(self) -> Verdict:
        """Whether what the map assumes of contacts, noise and surface held."""
        outliers = left_out(self._outliers, self._felt)
        return Verdict((*at_bounds(self._model, self._settings.model), *self._finer(), *outliers))

    @property
    def agreement(self) -> Agreement:
        """How well rows predict one another; its `factor` is on what every patch claims."""
        return self._agreement

    @property
    def facet_height(self) -> float:
        """Standard deviation of how far facets between rows lie off a smooth surface through them [m].

        Normals that err alike along a whole row, unlike those of the next one, are those of facets or the like. At
        worst facets are as wide as rows are apart and all rows are on ridges: then heights show nothing of what
        lies between. 0 where normals err by noise, which does not keep that far.
        """
        slope = math.sqrt(float(np.mean([each.slope_misfit for each in self._patches]))) if self._patches else 0.0
        patch = 2.0 * self._settings.patch_data
        return facet_height(self._model, self._settings.model, slope, patch, self._settings.rows)

    def add(self, cloud: TouchCloud) -> None:
        """Take in contacts that were felt after those before.

        The last stretch of path stays open: it counts, and goes on with the next batch.
        """
        self._refit(self._take_in(cloud))

    def _take_in(self, cloud: TouchCloud) -> set[int]:
        """Put contacts where they belong and return the patches that need to be fitted again."""
        if not len(cloud):
            return set()
        contacts = self._contacts(cloud)
        self._felt += len(cloud)
        changed: set[int] = set()
        if self._open is not None:
            contacts = self._open.followed_by(contacts)
            changed |= self._forget_open()
        length, pause = self._settings.stretch, self._settings.longest_pause
        off = spikes(contacts, self._settings.model.noise, 0.5 * length, pause)
        if off[self._before :].all():  # nothing is left to be far off from
            off[:] = False
        kept, outliers = (np.flatnonzero(each[self._before :]) + self._before for each in (~off, off))
        found, last = cut(contacts.at(kept), length, pause)
        begin = int(kept[last])
        self._outliers = np.vstack([self._outliers, contacts.position[outliers]])
        self._open_outliers = int((outliers >= begin).sum())
        self._before = min(begin, BEFORE)
        self._open = contacts.at(slice(begin - self._before, None))
        first = len(self._stretches)
        self._stretches = self._stretches.followed_by(found)
        self._tree = KDTree(self._stretches.position)
        return changed | self._join(first)

    def relearn(self, held: tuple[Parameter, ...] = ()) -> None:
        """Learn noise and surface from all that was felt, and fit every patch anew.

        Takes a second or two: before a report, or when an exploration has seen a few hundred square millimetres.

        Args:
            held: Numbers that stay as the settings say.
        """
        data = [
            PatchData.over(frame, self._stretches[self._chosen(index)]) for index, frame in enumerate(self._frames)
        ]
        self._model = learn(data, self._settings.model, held)
        self._refit(set(range(len(self._frames))))

    def query(self, points: FloatArray) -> SurfaceEstimate:
        """Return where the surface lies from each point, and how well that is known.

        Args:
            points: Shape (n, 3) [m], in the base frame.

        Raises:
            InvalidValueError: Another shape, or not finite.
        """
        x = numbers("points", points)
        if x.ndim != 2 or x.shape[1] != 3:
            raise InvalidValueError(f"points has shape {x.shape}: must be (n, 3) [m]")
        if not np.isfinite(x).all():
            at = int(np.flatnonzero(~np.isfinite(x).all(axis=1))[0])
            raise InvalidValueError(f"points[{at}] = {x[at].tolist()}: must be finite [m]")
        if self._tree is None or not len(x):
            return _nothing(len(x), self._settings.bias)
        return self._estimate(x, self._nearest(x))

    def observes(self, points: FloatArray) -> BoolArray:
        """Return where the nearest point of the surface is observed, shape (n,): `query` without deviations."""
        if self._tree is None or not len(points):
            return np.zeros(len(points), np.bool_)
        nearest = self._nearest(points)
        blend = self.blend_at(nearest)
        nearest = nearest - blend.distance[:, None] * blend.normal
        return np.asarray(self.knowledge_at(_or_zero(nearest), blend.normal)[0] == Knowledge.OBSERVED)

    def _nearest(self, x: FloatArray) -> FloatArray:
        """Return about the nearest point of the surface to each point, shape (n, 3) [m]."""
        plane, n = self._nearest_plane(x)
        nearest = x - plane[:, None] * n
        for _ in range(NEAREST_STEPS):
            step = self.blend_at(nearest)
            nearest = nearest - _or_zero(step.distance)[:, None] * _or_zero(step.normal)
            # back onto the line through x along the normal: the nearest point lies there, not merely on the
            # surface
            aside = (x - nearest) - ((x - nearest) * step.normal).sum(axis=1, keepdims=True) * step.normal
            nearest = nearest + _or_zero(aside)
        return nearest

    def blend_at(self, points: FloatArray, sheet: FloatArray | None = None, *, with_sd: bool = False) -> Blend:
        """Return blended heights above the surface at points near it: quick, and of first order in the height.

        Args:
            points: Shape (n, 3) [m].
            sheet: As for `patch_estimates`.
            with_sd: Whether standard deviations are wanted.
        """
        if self._tree is None:
            n = len(points)
            return Blend(np.full(n, np.nan), np.full((n, 3), np.nan), np.full(n, np.nan), np.full(n, np.nan))
        found = blended(self.patch_estimates(points, sheet), len(points), with_sd=with_sd)
        return dataclasses.replace(found, sd=np.hypot(self._factor * found.sd, self.facet_height))

    def patch_estimates(self, points: FloatArray, sheet: FloatArray | None = None) -> Iterator[PatchEstimate]:
        """Iterate over the estimates of all patches at points near the surface.

        Args:
            points: Shape (n, 3) [m].
            sheet: Normal of the nearest stretch of each, shape (n, 3), if known.
        """
        if self._tree is None:
            return iter(())
        sheets = self._stretches.normal[self._tree.query(points)[1]] if sheet is None else sheet
        return patch_estimates(points, sheets, self._patches, self._centers, self._settings.patch_reach)

    def knowledge_at(self, points: FloatArray, normals: FloatArray) -> tuple[np.ndarray, FloatArray]:
        """Return `Knowledge` and the distance to the nearest stretch at points of the surface, shapes (n,)."""
        knowledge = np.full(len(points), Knowledge.UNOBSERVED, np.int8)
        if self._tree is None:
            return knowledge, np.full(len(points), np.inf)
        contact_distance = np.asarray(self._tree.query(points)[0])
        known = np.isfinite(normals).all(axis=1) & (contact_distance <= self._settings.reach)
        knowledge[known] = Knowledge.EXTRAPOLATED
        near = np.flatnonzero(known)
        radius = SEARCH_REACHES * self._settings.reach
        inside = surrounded(points[near], normals[near], self._tree, self._stretches.normal, radius)
        knowledge[near[inside]] = Knowledge.OBSERVED
        return knowledge, contact_distance

    def _nearest_plane(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self._tree is None:
            return np.full(len(points), np.nan), np.full((len(points), 3), np.nan)
        _, nearest = self._tree.query(points)
        normal = self._stretches.normal[nearest]
        return ((points - self._stretches.position[nearest]) * normal).sum(axis=1), normal

    def _estimate(self, x: FloatArray, nearest: FloatArray) -> SurfaceEstimate:
        blend = self.blend_at(nearest, with_sd=True)
        nearest = nearest - blend.distance[:, None] * blend.normal
        knowledge, contact_distance = self.knowledge_at(_or_zero(nearest), blend.normal)
        distance = ((x - nearest) * blend.normal).sum(axis=1)
        return SurfaceEstimate(
            distance=distance,
            nearest=nearest,
            normal=blend.normal,
            sd=blend.sd,
            bias=self._settings.bias,
            contact_distance=contact_distance,
            knowledge=knowledge,
            surprise=blend.surprise,
        )

    def _finer(self) -> tuple[BrokenAssumption, ...]:
        return finer_than_rows(self._model, self._settings.model, self._settings.rows, self.facet_height)

    def _contacts(self, cloud: TouchCloud) -> PathContacts:
        ones, model = np.ones(len(cloud)), self._settings.model
        return PathContacts(
            time=cloud.time,
            position=cloud.position,
            normal=cloud.normal,
            noise=ones if cloud.noise is None else cloud.noise / model.noise,
            tilt=ones if cloud.tilt is None else cloud.tilt / model.tilt,
        )

    def _forget_open(self) -> set[int]:
        """Take the open stretch out again and return the patches that held it."""
        last = len(self._stretches) - 1
        self._stretches = self._stretches[:last]
        self._outliers = self._outliers[: len(self._outliers) - self._open_outliers]
        if self._open_patches:
            for held in (self._frames, self._patches, self._members):
                del held[-self._open_patches :]
            self._centers, self._axes = self._centers[: len(self._frames)], self._axes[: len(self._frames)]
        changed = {index for index, members in enumerate(self._members) if len(members) and members[-1] == last}
        for index in changed:
            self._members[index] = self._members[index][:-1]
        return changed

    def _join(self, first: int) -> set[int]:
        """Let stretches from `first` on into patches around them, new ones where there are none; return which."""
        assert self._tree is not None
        position, normal = self._stretches.position, self._stretches.normal
        started = first + seeds(
            position[first:], normal[first:], self._centers, self._axes, self._settings.patch_spacing, SEED_COS
        )
        before = len(self._frames)
        new = [PatchFrame.at(position[index], normal[index]) for index in started.tolist()]
        self._open_patches = int(len(new) > 0 and started[-1] == len(position) - 1)
        self._frames += new
        self._members += [np.zeros(0, np.intp)] * len(new)
        self._centers = np.vstack([self._centers, *(each.center for each in new)])
        self._axes = np.vstack([self._axes, *(each.axis for each in new)])
        reach = self._settings.patch_data
        near_new = np.asarray(KDTree(position[first:]).query_ball_point(self._centers, reach, return_length=True))
        joined = np.flatnonzero((near_new > 0) | (np.arange(len(near_new)) >= before))
        near = self._tree.query_ball_point(self._centers[joined], reach, return_sorted=True)
        changed = set(range(before, len(self._frames)))
        for patch, found in zip(joined.tolist(), near, strict=True):
            members = np.array(found, np.intp)
            members = members[normal[members] @ self._axes[patch] > STEEPEST_COS]
            if len(members) > len(self._members[patch]):
                self._members[patch] = members
                changed.add(patch)
        return changed

    def _fitted(self, frame: PatchFrame, stretches: Stretches) -> SurfacePatch:
        believed, middle = self._settings.model, 0.5 * self._settings.patch_spacing
        return SurfacePatch.fitted(frame, stretches, self._model, believed, middle)

    def _chosen(self, patch: int) -> np.ndarray:
        members = self._members[patch]
        most = self._settings.patch_stretches
        if len(members) <= most:
            return members
        return members[np.arange(most) * len(members) // most]

    def _refit(self, changed: set[int]) -> None:
        for index in sorted(changed):
            patch = self._fitted(self._frames[index], self._stretches[self._chosen(index)])
            self._patches[index : index + 1] = [patch]  # new ones follow one another
        self._agreement = Agreement.pooled(patch.agreement for patch in self._patches)
        self._factor = max(self._agreement.factor, WIDENED if self._finer() else 0.0)


def _or_zero(values: FloatArray) -> FloatArray:
    return np.nan_to_num(values, nan=0.0)


def _nothing(count: int, bias: float) -> SurfaceEstimate:
    nan = np.full(count, np.nan)
    nowhere = np.full((count, 3), np.nan)
    unobserved = np.full(count, Knowledge.UNOBSERVED, np.int8)
    return SurfaceEstimate(nan, nowhere, nowhere, nan, bias, np.full(count, np.inf), unobserved, nan)
