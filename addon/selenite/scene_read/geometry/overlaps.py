# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that lie in one plane on top of each other: Cycles shows something else there.

A ray that leaves a face in Cycles misses that face alone, and meets the other one at no distance:
it shows a shadow where this renderer shows one of both. With bpy 4.5, 64 pixels, means over the
picture of ours over theirs, and the worst block of 8 pixels in parts of the mean: a floor that is
there twice +106 % (366 %), a poster in the plane of a wall +1.6 % (34 %), a glass cube on a floor
+4 % (49 %), a ball of glass with a medium that is there twice -8 % (94 %), an area lamp in the
plane of a ceiling -44 % (636 %), two of them over a metal floor +1 % (21 %). At 1e-6 units of
distance, eight roundings, both agree again.

Where an opaque body stands on a floor, or against another one, nobody sees the faces between; both
agree (mean within 0.1 %, block 1.5 %), and that is no matter for a warning.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...messages import thing
from ...problems import Problem
from ..closedness import survey
from ..values import LightValues, MaterialValues, ObjectValues, SceneValues

#: What positions in 32 bits and their transformation are off by, in parts of a coordinate.
ROUNDING = 3e-7
#: What a quarter turn about an axis is off by, in parts of a size: its cosine is 4e-8.
TURNED = 5e-8
#: Triangles that share less than this part of their size touch; they do not overlap.
_TOUCH = 1e-4
#: Cosine beyond which normals are parallel, and the steps into which they are sorted.
PARALLEL, _STEP = 1 - 1e-6, 1e-4
#: Triangles and pairs of them that are looked at; what is beyond that goes unnoticed.
_MOST_TRIANGLES, _MOST_PAIRS, _PAIRS_AT_ONCE = 2_000_000, 20_000_000, 300_000
#: Objects whose boxes are compared with those of all others.
_MOST_BOXES = 4000
#: Corners of an ellipse, and pairs that are named one by one.
_CORNERS, _MOST_NAMED = 16, 8


class Surface:
    """An object, or an area lamp (`item` None), and the box (low, high) around it in the world."""

    def __init__(
        self, title: str, item: ObjectValues | None, points: np.ndarray, faces: np.ndarray,
        matrix: np.ndarray,
    ) -> None:  # fmt: skip
        self.title, self.item = title, item
        self.count = len(faces)
        self._points, self._faces, self._matrix = points, faces, matrix
        low, high = points.min(axis=0), points.max(axis=0)
        ends = np.stack([low, high])
        corners = np.array([ends[[i, j, k], [0, 1, 2]] for i, j, k in np.ndindex(2, 2, 2)])
        world = self._placed(corners)
        self.box = world.min(axis=0), world.max(axis=0)

    def triangles(self) -> np.ndarray:
        """(m, 3, 3) in the world, wound as a ray sees them."""
        mirrored = np.linalg.det(self._matrix[:3, :3]) < 0
        faces = self._faces[:, ::-1] if mirrored else self._faces
        return self._placed(self._points)[faces]

    def _placed(self, points: np.ndarray) -> np.ndarray:
        placed: np.ndarray = points @ self._matrix[:3, :3].T + self._matrix[:3, 3]
        return placed


@dataclass(frozen=True)
class Overlaps:
    """Of two surfaces, by number. triangles (k, 3, 3): of the first, which lie on those of the
    second (others). same_side (k,): whether both face the same way."""

    first: int
    second: int
    triangles: np.ndarray
    others: np.ndarray
    same_side: np.ndarray


def warn_of_overlaps(read: SceneValues) -> None:
    """Adds warnings, by name; problems of two objects that are one, and of walls that two bodies of
    glass share: Cycles shows another body then. Numpy alone, 0.5 s of CPU time for a million
    triangles."""
    surfaces = _surfaces(read)
    visible = _Visible(read)
    pairs: dict[tuple[str, str], None] = {}
    seen: set[tuple[int, int]] = set()
    glass = glass_of(read)
    for found in overlaps(surfaces, seen):
        first, second = surfaces[found.first], surfaces[found.second]
        if visible.are_seen(first, second, found):
            seen.add((found.first, found.second))
            title = (first.title, second.title)
            if problem := _fault(first, second, glass):
                read.refuse(problem)
                continue
            pairs.update({} if title[::-1] in pairs else {title: None})
    for one, other in list(pairs)[:_MOST_NAMED]:
        if one == other:
            read.warn(
                f"{one} is there more than once at one place, which Cycles shows otherwise (with "
                "shadows, or black): delete it there or move it"
            )
        else:
            read.warn(
                f"{one} and {other} have faces in one plane on top of each other, which Cycles "
                "shows otherwise (a shadow, or the other face): move one of them, or delete it"
            )
    if len(pairs) > _MOST_NAMED:
        read.warn(f"{len(pairs) - _MOST_NAMED} more pairs have faces on top of each other")


def _fault(first: Surface, second: Surface, glass: set[str]) -> Problem | None:
    """Why two surfaces with common faces cannot be rendered, if so. Of instances only warnings are
    given: where many are scattered, some meet."""
    if first.item is None or second.item is None or first.title == second.title:
        return None
    if _are_twins(first, second):
        cause = (
            f"it is there twice at one place, the other time as {_lower(second.title)}, which "
            "Cycles shows otherwise (with shadows, or black)"
        )
        return Problem(first.title, cause, "delete one of both")
    if glass.isdisjoint(first.item.materials) or glass.isdisjoint(second.item.materials):
        return None
    cause = (
        f"it shares a wall with {_lower(second.title)}, and light gets through both: Cycles meets "
        "one of two faces at one place, and another one each time"
    )
    cure = "let one reach a little into the other, or leave a gap"
    return Problem(first.title, cause, cure)


def _lower(title: str) -> str:
    return title[:1].lower() + title[1:]


def _are_twins(first: Surface, second: Surface) -> bool:
    """Whether both have the same triangles at the same places."""
    if first.count != second.count:
        return False
    one, other = (item.triangles().mean(axis=1) for item in (first, second))
    step = 1e-5 * max(float(np.ptp(one, axis=0).max(initial=0)), 1e-30)
    if np.abs(one - other).max(initial=0) <= step:
        return True
    ordered = [item[np.lexsort(np.rint(item / (7 * step)).T)] for item in (one, other)]
    return bool(np.abs(ordered[0] - ordered[1]).max(initial=0) <= 14 * step)


def glass_of(read: SceneValues) -> set[str]:
    """Names of the materials whose surface light passes through."""
    return {item.name for item in read.materials if _is_glass(item)}


def _is_glass(material: MaterialValues) -> bool:
    through = material.values.get("transmission", (0.0,))[0] > 0
    return through or "transmission" in material.maps or "extinction" in material.values


def _surfaces(read: SceneValues) -> list[Surface]:
    found = []
    clouds = {item.name for item in read.materials if item.grids}
    for item in read.objects:
        if clouds.issuperset(item.materials):
            continue  # Volume objects have no faces, and add where they overlap
        mesh = read.meshes[item.mesh]
        title = thing("Object", item.name)
        found.append(Surface(title, item, mesh.positions, mesh.triangles, item.matrix))
    for lamp in read.lights:
        if lamp.kind == "AREA":
            found.append(Surface(thing("Light", lamp.object), None, *_outline(lamp), lamp.matrix))
    return found


def _outline(lamp: LightValues) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 3) of an area lamp, and a fan of triangles."""
    half = float(lamp.shape["size_x"]) / 2, float(lamp.shape["size_y"]) / 2
    if lamp.shape["shape"] in {"DISK", "ELLIPSE"}:
        angle = 2 * np.pi * np.arange(_CORNERS) / _CORNERS
        flat = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    else:
        flat = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    corners = np.concatenate([flat * half, np.zeros((len(flat), 1))], axis=1)
    return corners, np.array([(0, i, i + 1) for i in range(1, len(flat) - 1)])


class _Visible:
    """Whether an overlap can be seen: no opaque body covers it."""

    def __init__(self, read: SceneValues) -> None:
        self._read = read
        self._clear = {item.name for item in read.materials if _is_clear(item)}
        self._closed: dict[int, bool] = {}
        self._eyes = np.array([item.matrix[:3, 3] for item in read.cameras]).reshape(-1, 3)

    def are_seen(self, first: Surface, second: Surface, found: Overlaps) -> bool:
        """Any of them; where a body covers one side of the common plane, from the other one."""
        covering = [self._covers(first), self._covers(second)]
        if not any(covering):
            return True
        seen = np.ones(len(found.triangles), bool)
        if all(covering):
            seen = found.same_side
        elif first.item is None or second.item is None:  # a lamp on a body
            return True
        triangles = (found.triangles if covering[0] else found.others)[seen]
        edges = triangles[:, 1:] - triangles[:, :1]
        towards = np.einsum(
            "ekj,kj->ek",
            self._eyes[:, None] - triangles[None, :, 0],
            np.cross(edges[:, 0], edges[:, 1]),
        )
        return bool(seen.any()) and (not len(self._eyes) or bool((towards > 0).any()))

    def _covers(self, surface: Surface) -> bool:
        item = surface.item
        if item is None:
            return False
        mesh = self._read.meshes[item.mesh]
        if any(item.materials[slot] in self._clear for slot in np.unique(mesh.material_slots)):
            return False
        if item.mesh not in self._closed:
            self._closed[item.mesh] = survey(mesh.positions, mesh.triangles).encloses
        return self._closed[item.mesh]


def _is_clear(material: MaterialValues) -> bool:
    """Whether light gets through its surface, or may."""
    if material.shader is not None:
        return material.shader.is_clear() or "extinction" in material.values
    varies = material.maps.keys() & {"alpha", "transmission"}
    opaque = material.values.get("alpha", (1.0,))[0] >= 1
    through = material.values.get("transmission", (0.0,))[0] > 0
    return bool(varies) or through or not opaque or "extinction" in material.values


def overlaps(
    surfaces: Sequence[Surface], known: Collection[tuple[int, int]] = ()
) -> Iterator[Overlaps]:
    """Pairs of surfaces that overlap in one plane. A pair may come more than once, unless it is in
    `known`, which may grow meanwhile."""
    triangles, owners = _candidates(surfaces)
    edges = triangles[:, 1:] - triangles[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    area = np.linalg.norm(normals, axis=1)
    size = np.abs(edges).max(axis=(1, 2), initial=0)
    real = area > 1e-12 * size**2
    if not real.any():
        return
    triangles, owners = triangles[real], owners[real]
    normals, size = normals[real] / area[real, None], size[real]
    axis = np.argmax(np.abs(normals), axis=1)
    for i, j in _pairs(triangles, owners, planes_of(triangles, normals), axis):
        if known:
            codes = np.minimum(owners[i], owners[j]) * len(surfaces)
            codes += np.maximum(owners[i], owners[j])
            new = ~np.isin(codes, [one * len(surfaces) + other for one, other in known])
            i, j = i[new], j[new]
        cosine = np.einsum("ij,ij->i", normals[i], normals[j])
        flat = np.abs(cosine) > PARALLEL
        i, j, cosine = i[flat], j[flat], cosine[flat]
        apart = triangles[j] - triangles[i][:, :1]
        between = np.abs(np.einsum("ikj,ij->ik", apart, normals[i])).max(axis=1)
        limit = np.einsum("ikj,ij->ik", np.abs(triangles[j]), np.abs(normals[i])).max(axis=1)
        near = between <= ROUNDING * limit + TURNED * np.minimum(size[i], size[j])
        i, j, cosine = i[near], j[near], cosine[near]
        inside = _share_area(triangles[i], triangles[j], axis[i])
        i, j, cosine = i[inside], j[inside], cosine[inside]
        turned = owners[i] > owners[j]
        i, j = np.where(turned, j, i), np.where(turned, i, j)
        pairs, which = np.unique(owners[i] * len(surfaces) + owners[j], return_inverse=True)
        for number, pair in enumerate(pairs):
            of = which == number
            first, second = divmod(int(pair), len(surfaces))
            yield Overlaps(first, second, triangles[i[of]], triangles[j[of]], cosine[of] > 0)


def _candidates(surfaces: Sequence[Surface]) -> tuple[np.ndarray, np.ndarray]:
    """Triangles inside the box of another surface (k, 3, 3), and whose they are. Small surfaces
    come first, as far as there is room."""
    low = np.array([item.box[0] for item in surfaces]).reshape(-1, 3)
    high = np.array([item.box[1] for item in surfaces]).reshape(-1, 3)
    margin = ROUNDING * np.maximum(np.abs(low), np.abs(high))
    margin += TURNED * (high - low).max(axis=1, keepdims=True, initial=0)
    low, high = low - margin, high + margin
    kept, owners = [np.empty((0, 3, 3))], [np.empty(0, int)]
    room = _MOST_TRIANGLES
    for index in np.argsort([item.count for item in surfaces], kind="stable")[:_MOST_BOXES]:
        near = ((low <= high[index]) & (high >= low[index])).all(axis=1)
        near[index] = False
        room -= surfaces[index].count if near.any() else 0
        if room < 0:
            break
        if not near.any():
            continue
        triangles = surfaces[index].triangles()
        least, most = triangles.min(axis=1), triangles.max(axis=1)
        inside = np.zeros(len(triangles), bool)
        for other in np.flatnonzero(near):
            inside |= ((least <= high[other]) & (most >= low[other])).all(axis=1)
            if inside.all():
                break
        kept.append(triangles[inside])
        owners.append(np.full(int(inside.sum()), index))
    return np.concatenate(kept), np.concatenate(owners)


def planes_of(triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """A number for each triangle, the same for those that may lie in one plane."""
    steps = np.rint(normals / _STEP).astype(np.int64)
    leading = np.take_along_axis(steps, np.argmax(np.abs(steps), axis=1)[:, None], axis=1)
    sign = np.where(leading < 0, -1, 1)
    steps, normals = steps * sign, normals * sign
    # Of parallel planes only: the normals of different triangles differ by roundings.
    key = (steps[:, 0] * 40_009 + steps[:, 1]) * 40_009 + steps[:, 2]
    products = np.abs(triangles) @ np.ones(3)
    place = np.einsum("ij,ij->i", triangles[:, 0], normals)
    slack = 4 * ROUNDING * products.max(axis=1)
    order = np.lexsort((place, key))
    ordered_key, ordered, reach = key[order], place[order], slack[order]
    new = np.ones(len(order), bool)
    gap = ordered[1:] - ordered[:-1] > reach[1:] + reach[:-1]
    new[1:] = gap | (ordered_key[1:] != ordered_key[:-1])
    planes = np.empty(len(order), np.int64)
    planes[order] = np.cumsum(new)
    return planes


def _pairs(
    triangles: np.ndarray, owners: np.ndarray, planes: np.ndarray, axis: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Indices of triangles of different owners in one plane whose ranges overlap along one of its
    axes, some at a time."""
    flat = np.array([(1, 2), (0, 2), (0, 1)])[axis]
    along = np.take_along_axis(triangles, flat[:, None, :1], axis=2)[..., 0]
    across = np.take_along_axis(triangles, flat[:, None, 1:], axis=2)[..., 0]
    low, high = along.min(axis=1), along.max(axis=1)
    bottom, top = across.min(axis=1), across.max(axis=1)
    start, width = low.min(), max(float(np.ptp(along)), 1e-30) * 1.001
    # Planes are apart by 1, ranges inside of one by their part of the whole.
    begin = planes + (low - start) / width * 0.999
    end = planes + (high - start) / width * 0.999
    order = np.argsort(begin, kind="stable")
    last = np.searchsorted(begin[order], end[order], side="right")
    counts = np.maximum(last - np.arange(len(order)) - 1, 0)
    sums = np.cumsum(counts)
    done = position = 0
    while position < len(order) and done < _MOST_PAIRS:
        stop = int(np.searchsorted(sums, done + _PAIRS_AT_ONCE, side="right"))
        stop = max(stop, position + 1)
        many = counts[position:stop]
        total = int(many.sum())
        i = np.repeat(np.arange(position, stop), many)
        offset = np.arange(total) - np.repeat(np.cumsum(many) - many, many)
        j = order[i + 1 + offset]
        i = order[i]
        position, done = stop, done + total
        apart = owners[i] != owners[j]
        apart &= (bottom[i] <= top[j]) & (bottom[j] <= top[i])
        if apart.any():
            yield i[apart], j[apart]


def _share_area(one: np.ndarray, other: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(k,) bool of triangles (k, 3, 3) in one plane, seen along an axis (k,): whether more than
    their rims overlap. No line along an edge of either has them on two sides."""
    flat = np.array([(1, 2), (0, 2), (0, 1)])[axis][:, None, :]
    first, second = (np.take_along_axis(item, flat, axis=2) for item in (one, other))
    found = np.ones(len(one), bool)
    for triangle in (first, second):
        for corner in range(3):
            edge = triangle[:, (corner + 1) % 3] - triangle[:, corner]
            normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1)
            length = np.linalg.norm(normal, axis=1, keepdims=True)
            normal = normal / np.maximum(length, 1e-300)
            a = np.einsum("ikj,ij->ik", first, normal)
            b = np.einsum("ikj,ij->ik", second, normal)
            margin = _TOUCH * np.minimum(np.ptp(a, axis=1), np.ptp(b, axis=1))
            common = np.minimum(a.max(axis=1), b.max(axis=1))
            common -= np.maximum(a.min(axis=1), b.min(axis=1))
            found &= common > margin
    return found
