"""Compiled inverse kinematics: Gauss-Newton and Newton on the tree, one frame from the last.

The Gauss-Newton matrix of a tree of markers is the joint-space mass matrix of point masses: every
marker is a mass of its weight. It is built by the composite-rigid-body algorithm and factored
without fill-in by the tree's own sparsity (Featherstone 2008, chapters 6.2 and 8.6).
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from bsip_cli.motion.compiled import compiled

FREE, SPHERICAL, REVOLUTE = 0, 1, 2
Array = np.ndarray

# The skeleton: per segment its joint's kind, parent, first entry in q and v, place and turn in the
# parent and hinge axis; per velocity its segment and the velocity before it on the way to the base.
Tree = namedtuple(
    "Tree", "kinds parents q_starts v_starts v_segments v_parents positions rotations axes"
)
# What is fitted: segment, place on it [m] and weight [1/m2] of each marker; the residual [m] beyond
# which a marker's pull fades; and the precision (nv,) [1/rad2] that pulls angles to zero.
Task = namedtuple("Task", "segments positions weights limit prior")


@compiled
def _cross(a: Array, b: Array, out: Array) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def _rotation_of_quaternion(q: Array, out: Array) -> None:
    x, y, z, w = q[0], q[1], q[2], q[3]
    out[0, 0] = 1 - 2 * (y * y + z * z)
    out[0, 1] = 2 * (x * y - z * w)
    out[0, 2] = 2 * (x * z + y * w)
    out[1, 0] = 2 * (x * y + z * w)
    out[1, 1] = 1 - 2 * (x * x + z * z)
    out[1, 2] = 2 * (y * z - x * w)
    out[2, 0] = 2 * (x * z - y * w)
    out[2, 1] = 2 * (y * z + x * w)
    out[2, 2] = 1 - 2 * (x * x + y * y)


@compiled
def _turn_quaternion(q: Array, omega: Array) -> None:
    """q <- q * exp(omega), omega in the body's own axes."""
    angle = np.sqrt(omega[0] ** 2 + omega[1] ** 2 + omega[2] ** 2)
    k = 0.5 if angle < 1e-12 else np.sin(0.5 * angle) / angle
    c = np.cos(0.5 * angle)
    ex, ey, ez = k * omega[0], k * omega[1], k * omega[2]
    x, y, z, w = q[0], q[1], q[2], q[3]
    q[0] = x * c + w * ex + y * ez - z * ey
    q[1] = y * c + w * ey + z * ex - x * ez
    q[2] = z * c + w * ez + x * ey - y * ex
    q[3] = w * c - x * ex - y * ey - z * ez
    norm = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for k2 in range(4):
        q[k2] /= norm


@compiled
def _hinge_rotation(u: Array, angle: float, out: Array) -> None:
    """Rotation by an angle about a unit axis (Rodrigues)."""
    c, s = np.cos(angle), np.sin(angle)
    for j in range(3):
        for k in range(3):
            out[j, k] = (1 - c) * u[j] * u[k]
        out[j, j] += c
    out[0, 1] -= s * u[2]
    out[0, 2] += s * u[1]
    out[1, 0] += s * u[2]
    out[1, 2] -= s * u[0]
    out[2, 0] -= s * u[1]
    out[2, 1] += s * u[0]


@compiled
def forward(q: Array, tree: Tree, R: Array, p: Array) -> None:
    """Fill R (n, 3, 3) and p (n, 3): orientation of each segment and its joint centre, world."""
    local = np.empty((3, 3))
    for i in range(tree.kinds.size):
        at = tree.q_starts[i]
        if tree.kinds[i] == FREE:
            p[i] = q[at : at + 3]
            _rotation_of_quaternion(q[at + 3 : at + 7], R[i])
            continue
        if tree.kinds[i] == SPHERICAL:
            _rotation_of_quaternion(q[at : at + 4], local)
        else:
            _hinge_rotation(tree.axes[i], q[at], local)
        parent = tree.parents[i]
        Rp, R0 = R[parent], tree.rotations[i]
        for j in range(3):
            p[i, j] = p[parent, j]
            for k in range(3):
                p[i, j] += Rp[j, k] * tree.positions[i, k]
                total = 0.0
                for a in range(3):
                    for b in range(3):
                        total += Rp[j, a] * R0[a, b] * local[b, k]
                R[i, j, k] = total


@compiled
def _angles(q: Array, tree: Tree) -> Array:
    """(nv,) joint angles, which the prior pulls to zero; of the base, zeros. Of a unit quaternion
    the rotation vector, by the shorter way."""
    angles = np.zeros(tree.v_segments.size)
    for i in range(1, tree.kinds.size):
        at, av = tree.q_starts[i], tree.v_starts[i]
        if tree.kinds[i] == SPHERICAL:
            sign = 1.0 if q[at + 3] >= 0 else -1.0
            s = np.sqrt(q[at] ** 2 + q[at + 1] ** 2 + q[at + 2] ** 2)
            k = 2.0 if s < 1e-12 else 2.0 * np.arctan2(s, sign * q[at + 3]) / s
            for j in range(3):
                angles[av + j] = sign * k * q[at + j]
        else:
            angles[av] = q[at]
    return angles


@compiled
def _evaluate(
    q: Array, tree: Tree, task: Task, measured: Array, R: Array, p: Array, residuals: Array
) -> float:
    """Pose the model; fill R, p and the residuals (m, 3): measured less model, NaN where missing.

    Returns the cost: half the weighted squares, growing like the logarithm beyond the limit, plus
    the prior.
    """
    forward(q, tree, R, p)
    total, limit = 0.0, task.limit
    for m in range(task.weights.size):
        s, r = task.segments[m], residuals[m]
        for j in range(3):
            r[j] = measured[m, j] - p[s, j]
            for k in range(3):
                r[j] -= R[s, j, k] * task.positions[m, k]
        d2 = r[0] ** 2 + r[1] ** 2 + r[2] ** 2
        if np.isnan(d2):
            continue
        d = np.sqrt(d2)
        loss = 0.5 * d2 if d <= limit else limit**2 * (0.5 + np.log(d / limit))
        total += task.weights[m] * loss
    angles = _angles(q, tree)
    for k in range(6, angles.size):
        total += 0.5 * task.prior[k] * angles[k] ** 2
    return total


@compiled
def _columns(R: Array, p: Array, tree: Tree, d: Array, w: Array) -> None:
    """Velocity d + w x r that each unit velocity gives a point r (from the base's origin)."""
    r = np.empty(3)
    for i in range(tree.kinds.size):
        at = tree.v_starts[i]
        if tree.kinds[i] == FREE:
            d[at : at + 3], w[at : at + 3] = R[i].T, 0.0
            d[at + 3 : at + 6], w[at + 3 : at + 6] = 0.0, R[i].T
            continue
        for j in range(3):
            r[j] = p[i, j] - p[0, j]
        if tree.kinds[i] == SPHERICAL:
            w[at : at + 3] = R[i].T
            for k in range(3):
                _cross(r, w[at + k], d[at + k])
        else:
            for j in range(3):
                w[at, j] = 0.0
                for k in range(3):
                    w[at, j] += R[i, j, k] * tree.axes[i, k]
            _cross(r, w[at], d[at])


@compiled
def _gather(
    residuals: Array, measured: Array, base: Array, tree: Tree, task: Task, sums: Array
) -> None:
    """Fill sums (n, 4, 10) over the markers on each segment and beyond: weighted products of (x, 1)
    and (x, 1, r, x x r) of places x from the base's origin and residuals r."""
    sums[:] = 0.0
    row = np.ones(10)
    for m in range(task.weights.size):
        if np.isnan(residuals[m, 0]):
            continue
        i, r = task.segments[m], residuals[m]
        distance = np.sqrt(r[0] ** 2 + r[1] ** 2 + r[2] ** 2)
        trust = 1.0 if distance <= task.limit else (task.limit / distance) ** 2
        weight = task.weights[m] * trust
        for j in range(3):
            row[j], row[4 + j] = measured[m, j] - r[j] - base[j], r[j]
        _cross(row[:3], r, row[7:])
        for j in range(4):
            for k in range(10):
                sums[i, j, k] += weight * row[j] * row[k]
    for i in range(tree.kinds.size - 1, 0, -1):
        sums[tree.parents[i]] += sums[i]


@compiled
def _assemble(
    d: Array, w: Array, sums: Array, q: Array, tree: Tree, task: Task, H: Array, g: Array
) -> None:
    """H (nv, nv; only between a velocity and its ancestors) and descent direction g of the markers
    and of the prior, which pulls the joint angles to zero."""
    F, T = np.empty(3), np.empty(3)
    for k in range(g.size):
        i = tree.v_segments[k]
        S = sums[i]
        trace = S[0, 0] + S[1, 1] + S[2, 2]
        _cross(w[k], S[:3, 3], F)
        _cross(S[:3, 3], d[k], T)
        g[k] = 0.0
        for j in range(3):
            F[j] += S[3, 3] * d[k, j]
            T[j] += trace * w[k, j]
            for b in range(3):
                T[j] -= S[j, b] * w[k, b]
            g[k] += d[k, j] * S[3, 4 + j] + w[k, j] * S[3, 7 + j]
        a = k
        while a >= 0:
            H[k, a] = 0.0
            for j in range(3):
                H[k, a] += d[a, j] * F[j] + w[a, j] * T[j]
            a = tree.v_parents[a]
    angles = _angles(q, tree)
    for k in range(6, angles.size):
        H[k, k] += task.prior[k]
        g[k] -= task.prior[k] * angles[k]


@compiled
def _bend(d: Array, w: Array, sums: Array, tree: Tree, N: Array, H: Array) -> None:
    """Add to H what the curvature of the markers' paths makes of the residuals (Newton's term).

    A marker at x moves by d_k + w_k x x when velocity k does, and an ancestor's rotation w_a turns
    that: r . (w_a x (d_k + w_k x x)), summed over the markers, is w_a . N_k. Two rotations of one
    joint act together, which symmetrises the term.
    """
    for k in range(len(d)):
        i = tree.v_segments[k]
        M = sums[i, :3, 4:7]
        trace = M[0, 0] + M[1, 1] + M[2, 2]
        _cross(d[k], sums[i, 3, 4:7], N[k])
        for j in range(3):
            N[k, j] -= trace * w[k, j]
            for b in range(3):
                N[k, j] += M[j, b] * w[k, b]
        if tree.kinds[i] == FREE and k < tree.v_starts[i] + 3:
            continue  # translations of the base bend nothing
        a = k
        while a >= 0:
            if tree.v_segments[a] != i:
                for j in range(3):
                    H[k, a] -= w[a, j] * N[k, j]
            elif not (tree.kinds[i] == FREE and a < tree.v_starts[i] + 3):
                for j in range(3):
                    H[k, a] -= 0.5 * (w[a, j] * N[k, j] + w[k, j] * N[a, j])
            a = tree.v_parents[a]


@compiled
def _factor(H: Array, damping: float, v_parents: Array, L: Array) -> bool:
    """L with H + damping diag(H) = L^T L; no fill-in (Featherstone 2008, table 6.3).

    Returns whether the matrix is positive definite.
    """
    definite, nv = True, len(H)
    L[:] = H
    for k in range(nv):
        L[k, k] += damping * H[k, k] + 1e-12
    for k in range(nv - 1, -1, -1):
        definite &= L[k, k] > 0
        L[k, k] = np.sqrt(max(L[k, k], 1e-12))
        i = v_parents[k]
        while i >= 0:
            L[k, i] /= L[k, k]
            i = v_parents[i]
        i = v_parents[k]
        while i >= 0:
            j = i
            while j >= 0:
                L[i, j] -= L[k, i] * L[k, j]
                j = v_parents[j]
            i = v_parents[i]
    return definite


@compiled
def _solve(L: Array, v_parents: Array, x: Array) -> None:
    """x <- (L^T L)^-1 x."""
    nv = v_parents.size
    for i in range(nv - 1, -1, -1):
        x[i] /= L[i, i]
        j = v_parents[i]
        while j >= 0:
            x[j] -= L[i, j] * x[i]
            j = v_parents[j]
    for i in range(nv):
        j = v_parents[i]
        while j >= 0:
            x[i] -= L[i, j] * x[j]
            j = v_parents[j]
        x[i] /= L[i, i]


@compiled
def _step(q: Array, dv: Array, tree: Tree, R0: Array, out: Array) -> None:
    """out = q moved by dv (base: translation and rotation in its own axes)."""
    out[:] = q
    for i in range(tree.kinds.size):
        at, av = tree.q_starts[i], tree.v_starts[i]
        if tree.kinds[i] == FREE:
            for j in range(3):
                for k in range(3):
                    out[at + j] += R0[j, k] * dv[av + k]
            _turn_quaternion(out[at + 3 : at + 7], dv[av + 3 : av + 6])
        elif tree.kinds[i] == SPHERICAL:
            _turn_quaternion(out[at : at + 4], dv[av : av + 3])
        else:
            out[at] += dv[av]


@compiled
def _solve_frame(
    q: Array, measured: Array, tree: Tree, task: Task, max_steps: int, residuals: Array, L: Array
) -> int:
    """Move q to the least-squares pose of one frame; return the steps, or -1 if they ran out.

    Fills the residuals (m, 3) at the pose and L, the factor of the Gauss-Newton matrix there.
    """
    n, nv = tree.kinds.size, tree.v_segments.size
    R, p = np.zeros((n, 3, 3)), np.zeros((n, 3))
    d, w = np.zeros((nv, 3)), np.zeros((nv, 3))
    H, g, dv = np.zeros((nv, nv)), np.zeros(nv), np.zeros(nv)
    N, sums = np.zeros((nv, 3)), np.zeros((n, 4, 10))
    trial, trial_residuals = q.copy(), residuals.copy()
    cost = _evaluate(q, tree, task, measured, R, p, residuals)
    damping, taken = 0.0, -1
    for step in range(max_steps):
        _columns(R, p, tree, d, w)
        _gather(residuals, measured, p[0], tree, task, sums)
        _assemble(d, w, sums, q, tree, task, H, g)
        base, trial_cost = R[0].copy(), np.inf
        newton = step > 0 and damping == 0.0  # near the optimum: quadratic convergence
        if newton:
            _bend(d, w, sums, tree, N, H)
        while damping < 1e6:
            definite = _factor(H, damping, tree.v_parents, L)
            if definite or not newton:
                dv[:] = g
                _solve(L, tree.v_parents, dv)
                _step(q, dv, tree, base, trial)
                trial_cost = _evaluate(trial, tree, task, measured, R, p, trial_residuals)
                if trial_cost <= cost * (1 + 1e-14):
                    break
            if newton:  # its matrix does not help here
                _assemble(d, w, sums, q, tree, task, H, g)
                newton = False
            else:
                damping = max(10 * damping, 1e-4)
        if trial_cost > cost * (1 + 1e-14):  # no step helps: q is the optimum
            taken = step
            break
        gain = cost - trial_cost
        q[:] = trial
        residuals[:] = trial_residuals
        cost = trial_cost
        damping = 0.0 if damping < 1e-3 else 0.1 * damping
        if gain <= 1e-9 * cost + 1e-14 or np.max(np.abs(dv)) < 1e-8:
            taken = step + 1
            break
    _assemble(d, w, sums, q, tree, task, H, g)
    _factor(H, 0.0, tree.v_parents, L)
    return taken


@compiled
def solve_frames(
    markers: Array,
    starts: Array,
    tree: Tree,
    task: Task,
    max_steps: int,
    q_out: Array,
    residual_out: Array,
    sd_out: Array,
    steps_out: Array,
) -> None:
    """Least-squares pose of every frame, from its start where it has one, else from the last frame
    that shows a marker: without one the prior leads to the neutral pose, from which others may end
    in a wrong optimum.

    markers (N, m, 3) [m], NaN where missing; starts (k, nq) of the first k frames. Fills q_out
    (N, nq), residual_out (N, m) [m], sd_out (N, nv) (standard deviation of each coordinate, given
    those nearer to the base) and steps_out (N,), -1 where the steps ran out.
    """
    nv = tree.v_segments.size
    residuals, L = np.empty((task.weights.size, 3)), np.zeros((nv, nv))
    q, last = starts[0].copy(), starts[0].copy()
    for frame in range(markers.shape[0]):
        if frame < starts.shape[0]:
            q[:] = starts[frame]
        steps_out[frame] = _solve_frame(q, markers[frame], tree, task, max_steps, residuals, L)
        q_out[frame] = q
        if np.isnan(markers[frame]).all():
            q[:] = last
        last[:] = q
        sd_out[frame] = 1.0 / np.diag(L)
        x, y, z = residuals[:, 0], residuals[:, 1], residuals[:, 2]
        residual_out[frame] = np.sqrt(x**2 + y**2 + z**2)


@compiled
def forward_frames(q: Array, tree: Tree, R: Array, p: Array) -> None:
    """Fill R (N, n, 3, 3) and p (N, n, 3) for q (N, nq)."""
    for frame in range(q.shape[0]):
        forward(q[frame], tree, R[frame], p[frame])


@compiled
def marker_columns(
    R: Array, p: Array, markers: Array, tree: Tree, below: Array, columns: Array
) -> None:
    """Fill columns (N, m, 3, nv) with the velocity of each marker (N, m, 3) for each unit velocity
    where it hangs on that joint: below (n, m)."""
    nv = tree.v_segments.size
    d, w, x, turned = np.empty((nv, 3)), np.empty((nv, 3)), np.empty(3), np.empty(3)
    for frame in range(markers.shape[0]):
        _columns(R[frame], p[frame], tree, d, w)
        for m in range(markers.shape[1]):
            for j in range(3):
                x[j] = markers[frame, m, j] - p[frame, 0, j]
            for k in range(nv):
                if below[tree.v_segments[k], m]:
                    _cross(w[k], x, turned)
                    for j in range(3):
                        columns[frame, m, j, k] = d[k, j] + turned[j]
