"""Compiled inverse kinematics: Gauss-Newton on the tree, one frame from the last.

The Gauss-Newton matrix of a tree of markers is the joint-space mass matrix of point masses: every
marker is a mass of its weight. It is built by the composite-rigid-body algorithm and factored
without fill-in by the tree's own sparsity (Featherstone 2008, chapters 6.2 and 8.6).
"""

from __future__ import annotations

import numpy as np
from numba import njit

FREE, SPHERICAL, REVOLUTE = 0, 1, 2


@njit(cache=True)
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _rotation_of_quaternion(q, out):
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


@njit(cache=True)
def _turn_quaternion(q, omega):
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


@njit(cache=True)
def _rotation_vector(q, out):
    """Rotation vector of a unit quaternion, by the shorter way."""
    sign = 1.0 if q[3] >= 0 else -1.0
    s = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2)
    k = 2.0 if s < 1e-12 else 2.0 * np.arctan2(s, sign * q[3]) / s
    for i in range(3):
        out[i] = sign * k * q[i]


@njit(cache=True)
def forward(q, kinds, parents, q_starts, positions, rotations, axes, R, p):
    """Fill R (n, 3, 3) and p (n, 3): orientation of each segment and its joint centre, world."""
    local = np.empty((3, 3))
    for i in range(kinds.size):
        at = q_starts[i]
        if kinds[i] == FREE:
            p[i] = q[at : at + 3]
            _rotation_of_quaternion(q[at + 3 : at + 7], R[i])
            continue
        if kinds[i] == SPHERICAL:
            _rotation_of_quaternion(q[at : at + 4], local)
        else:
            u, c, s = axes[i], np.cos(q[at]), np.sin(q[at])
            for j in range(3):
                for k in range(3):
                    local[j, k] = (1 - c) * u[j] * u[k]
                local[j, j] += c
            local[0, 1] -= s * u[2]
            local[0, 2] += s * u[1]
            local[1, 0] += s * u[2]
            local[1, 2] -= s * u[0]
            local[2, 0] -= s * u[1]
            local[2, 1] += s * u[0]
        parent = parents[i]
        Rp, R0 = R[parent], rotations[i]
        for j in range(3):
            p[i, j] = p[parent, j]
            for k in range(3):
                p[i, j] += Rp[j, k] * positions[i, k]
                total = 0.0
                for a in range(3):
                    for b in range(3):
                        total += Rp[j, a] * R0[a, b] * local[b, k]
                R[i, j, k] = total


@njit(cache=True)
def _residuals(R, p, marker_segments, marker_positions, measured, out):
    """out (m, 3) = measured - model; rows of missing markers are NaN."""
    for m in range(marker_segments.size):
        s = marker_segments[m]
        for j in range(3):
            out[m, j] = measured[m, j] - p[s, j]
            for k in range(3):
                out[m, j] -= R[s, j, k] * marker_positions[m, k]


@njit(cache=True)
def _cost(residuals, weights, limit, q, kinds, q_starts, v_starts, prior):
    """Half the weighted squares, growing like the logarithm beyond ``limit``, plus the prior."""
    total = 0.0
    for m in range(weights.size):
        d2 = residuals[m, 0] ** 2 + residuals[m, 1] ** 2 + residuals[m, 2] ** 2
        if np.isnan(d2):
            continue
        d = np.sqrt(d2)
        total += weights[m] * (0.5 * d2 if d <= limit else limit**2 * (0.5 + np.log(d / limit)))
    turn = np.empty(3)
    for i in range(1, kinds.size):
        at = q_starts[i]
        if kinds[i] == SPHERICAL:
            _rotation_vector(q[at : at + 4], turn)
            for j in range(3):
                total += 0.5 * prior[v_starts[i] + j] * turn[j] ** 2
        else:
            total += 0.5 * prior[v_starts[i]] * q[at] ** 2
    return total


@njit(cache=True)
def _columns(R, p, kinds, v_starts, axes, d, w):
    """Velocity d + w x r that each unit velocity gives a point r (from the base's origin)."""
    r = np.empty(3)
    for i in range(kinds.size):
        at = v_starts[i]
        if kinds[i] == FREE:
            for k in range(3):
                for j in range(3):
                    d[at + k, j] = R[i, j, k]
                    w[at + k, j] = 0.0
                    d[at + 3 + k, j] = 0.0
                    w[at + 3 + k, j] = R[i, j, k]
            continue
        for j in range(3):
            r[j] = p[i, j] - p[0, j]
        if kinds[i] == SPHERICAL:
            for k in range(3):
                for j in range(3):
                    w[at + k, j] = R[i, j, k]
                _cross(r, w[at + k], d[at + k])
        else:
            for j in range(3):
                w[at, j] = 0.0
                for k in range(3):
                    w[at, j] += R[i, j, k] * axes[i, k]
            _cross(r, w[at], d[at])


@njit(cache=True)
def _normal_equations(
    R,
    p,
    residuals,
    weights,
    limit,
    kinds,
    parents,
    q_starts,
    v_starts,
    v_segments,
    v_parents,
    axes,
    marker_segments,
    measured,
    q,
    prior,
    H,
    g,
    W,
    s,
    S,
    f,
    t,
    d,
    w,
):
    """H (nv, nv; only entries between a velocity and its ancestors) and descent direction g."""
    n, nv = kinds.size, v_segments.size
    W[:] = 0.0
    s[:] = 0.0
    S[:] = 0.0
    f[:] = 0.0
    t[:] = 0.0
    x = np.empty(3)
    moment = np.empty(3)
    for m in range(weights.size):
        if np.isnan(residuals[m, 0]):
            continue
        i = marker_segments[m]
        r = residuals[m]
        distance = np.sqrt(r[0] ** 2 + r[1] ** 2 + r[2] ** 2)
        weight = weights[m] * (1.0 if distance <= limit else (limit / distance) ** 2)
        for j in range(3):
            x[j] = measured[m, j] - r[j] - p[0, j]
        _cross(x, r, moment)
        W[i] += weight
        for j in range(3):
            s[i, j] += weight * x[j]
            f[i, j] += weight * r[j]
            t[i, j] += weight * moment[j]
            for k in range(3):
                S[i, j, k] += weight * x[j] * x[k]
    for i in range(n - 1, 0, -1):
        a = parents[i]
        W[a] += W[i]
        for j in range(3):
            s[a, j] += s[i, j]
            f[a, j] += f[i, j]
            t[a, j] += t[i, j]
            for k in range(3):
                S[a, j, k] += S[i, j, k]
    _columns(R, p, kinds, v_starts, axes, d, w)
    F = np.empty(3)
    T = np.empty(3)
    for k in range(nv):
        i = v_segments[k]
        trace = S[i, 0, 0] + S[i, 1, 1] + S[i, 2, 2]
        _cross(w[k], s[i], F)
        _cross(s[i], d[k], T)
        for j in range(3):
            F[j] += W[i] * d[k, j]
            T[j] += trace * w[k, j]
            for b in range(3):
                T[j] -= S[i, j, b] * w[k, b]
        g[k] = 0.0
        for j in range(3):
            g[k] += d[k, j] * f[i, j] + w[k, j] * t[i, j]
        a = k
        while a >= 0:
            H[k, a] = 0.0
            for j in range(3):
                H[k, a] += d[a, j] * F[j] + w[a, j] * T[j]
            a = v_parents[a]
    turn = np.empty(3)
    for i in range(1, n):
        at = v_starts[i]
        if kinds[i] == SPHERICAL:
            _rotation_vector(q[q_starts[i] : q_starts[i] + 4], turn)
            for j in range(3):
                H[at + j, at + j] += prior[at + j]
                g[at + j] -= prior[at + j] * turn[j]
        else:
            H[at, at] += prior[at]
            g[at] -= prior[at] * q[q_starts[i]]


@njit(cache=True)
def _factor(H, damping, v_parents, L):
    """L with H + damping diag(H) = L^T L; no fill-in (Featherstone 2008, table 6.3)."""
    nv = v_parents.size
    for k in range(nv):
        a = k
        while a >= 0:
            L[k, a] = H[k, a]
            a = v_parents[a]
        L[k, k] += damping * H[k, k] + 1e-12
    for k in range(nv - 1, -1, -1):
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


@njit(cache=True)
def _solve(L, v_parents, x):
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


@njit(cache=True)
def _step(q, dv, kinds, q_starts, v_starts, R0, out):
    """out = q moved by dv (base: translation and rotation in its own axes)."""
    out[:] = q
    for i in range(kinds.size):
        at, av = q_starts[i], v_starts[i]
        if kinds[i] == FREE:
            for j in range(3):
                for k in range(3):
                    out[at + j] += R0[j, k] * dv[av + k]
            _turn_quaternion(out[at + 3 : at + 7], dv[av + 3 : av + 6])
        elif kinds[i] == SPHERICAL:
            _turn_quaternion(out[at : at + 4], dv[av : av + 3])
        else:
            out[at] += dv[av]


@njit(cache=True)
def solve_frames(
    markers,
    q_first,
    marker_segments,
    marker_positions,
    weights,
    limit,
    prior,
    max_steps,
    kinds,
    parents,
    q_starts,
    v_starts,
    v_segments,
    v_parents,
    positions,
    rotations,
    axes,
    q_out,
    residual_out,
    sd_out,
    steps_out,
):
    """Least-squares pose of every frame, each started from the last.

    markers (N, m, 3) [m], NaN where missing; weights (m,) [1/m2]; limit [m] beyond which a
    marker's pull fades; prior (nv,) [1/rad2] that pulls the joint angles to zero; q_first (nq,).
    Fills q_out (N, nq), residual_out (N, m) [m], sd_out (N, nv) (standard deviation of each
    coordinate, given those nearer to the base) and steps_out (N,), -1 where the steps ran out.
    """
    n, m, nv = kinds.size, weights.size, v_segments.size
    R, p = np.zeros((n, 3, 3)), np.zeros((n, 3))
    residuals, trial_residuals = np.empty((m, 3)), np.empty((m, 3))
    H, L, g = np.zeros((nv, nv)), np.zeros((nv, nv)), np.zeros(nv)
    W, s, S = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    f, t = np.zeros((n, 3)), np.zeros((n, 3))
    d, w = np.zeros((nv, 3)), np.zeros((nv, 3))
    q, trial, dv = q_first.copy(), q_first.copy(), np.zeros(nv)
    for frame in range(markers.shape[0]):
        measured = markers[frame]
        damping = 0.0
        forward(q, kinds, parents, q_starts, positions, rotations, axes, R, p)
        _residuals(R, p, marker_segments, marker_positions, measured, residuals)
        cost = _cost(residuals, weights, limit, q, kinds, q_starts, v_starts, prior)
        steps_out[frame] = -1
        for step in range(max_steps):
            _normal_equations(
                R,
                p,
                residuals,
                weights,
                limit,
                kinds,
                parents,
                q_starts,
                v_starts,
                v_segments,
                v_parents,
                axes,
                marker_segments,
                measured,
                q,
                prior,
                H,
                g,
                W,
                s,
                S,
                f,
                t,
                d,
                w,
            )
            better = False
            while damping < 1e6:
                _factor(H, damping, v_parents, L)
                dv[:] = g
                _solve(L, v_parents, dv)
                _step(q, dv, kinds, q_starts, v_starts, R[0], trial)
                forward(trial, kinds, parents, q_starts, positions, rotations, axes, R, p)
                _residuals(R, p, marker_segments, marker_positions, measured, trial_residuals)
                trial_cost = _cost(
                    trial_residuals, weights, limit, trial, kinds, q_starts, v_starts, prior
                )
                if trial_cost <= cost * (1 + 1e-14):
                    better = True
                    break
                damping = max(10 * damping, 1e-4)
                forward(q, kinds, parents, q_starts, positions, rotations, axes, R, p)
            if not better:
                steps_out[frame] = step
                break
            gain = cost - trial_cost
            q[:] = trial
            residuals[:] = trial_residuals
            cost = trial_cost
            damping = 0.0 if damping < 1e-3 else 0.1 * damping
            if gain <= 1e-9 * cost + 1e-14 or np.max(np.abs(dv)) < 1e-8:
                steps_out[frame] = step + 1
                break
        _factor(H, 0.0, v_parents, L)
        q_out[frame] = q
        for k in range(nv):
            sd_out[frame, k] = 1.0 / L[k, k]
        for k in range(m):
            residual_out[frame, k] = np.sqrt(
                residuals[k, 0] ** 2 + residuals[k, 1] ** 2 + residuals[k, 2] ** 2
            )


@njit(cache=True)
def forward_frames(q, kinds, parents, q_starts, positions, rotations, axes, R, p):
    """Fill R (N, n, 3, 3) and p (N, n, 3) for q (N, nq)."""
    for frame in range(q.shape[0]):
        forward(q[frame], kinds, parents, q_starts, positions, rotations, axes, R[frame], p[frame])
