"""Numba kernels of kinematics, skinning and their Jacobians (float64, one thread, no GIL).

Parameters are ordered (transl 3, rotation increments 24 x 3, betas B, log scale 1). A rotation
increment turns joint j from the left, in its parent's frame: R_j <- exp(delta) R_j. The derivative
of a point is then, for every ancestor, axis x lever arm, with G_parent's columns as axes.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def forward_kinematics(R_local, rest_joints, parents):
    """Return global rotations G (24,3,3) and joint positions p (24,3), root at its rest place."""
    n = rest_joints.shape[0]
    G = np.empty((n, 3, 3))
    p = np.empty((n, 3))
    for j in range(n):
        parent = parents[j]
        if parent < 0:
            G[j] = R_local[j]
            p[j] = rest_joints[j]
            continue
        for r in range(3):
            p[j, r] = p[parent, r]
            for c in range(3):
                bone = rest_joints[j, c] - rest_joints[parent, c]
                p[j, r] += G[parent, r, c] * bone
                total = 0.0
                for k in range(3):
                    total += G[parent, r, k] * R_local[j, k, c]
                G[j, r, c] = total
    return G, p


@njit(cache=True, nogil=True)
def joint_shape_derivatives(G, joint_shapedirs, parents):
    """Return dp/dbeta (24,3,B) of posed joints, and e = dp - G dJ used by skinning."""
    n, _, n_betas = joint_shapedirs.shape
    dp = np.empty((n, 3, n_betas))
    e = np.empty((n, 3, n_betas))
    for j in range(n):
        parent = parents[j]
        for r in range(3):
            for b in range(n_betas):
                if parent < 0:
                    dp[j, r, b] = joint_shapedirs[j, r, b]
                else:
                    total = dp[parent, r, b]
                    for c in range(3):
                        bone = joint_shapedirs[j, c, b] - joint_shapedirs[parent, c, b]
                        total += G[parent, r, c] * bone
                    dp[j, r, b] = total
                total = dp[j, r, b]
                for c in range(3):
                    total -= G[j, r, c] * joint_shapedirs[j, c, b]
                e[j, r, b] = total
    return dp, e


@njit(cache=True, nogil=True)
def attached_places(joint, template, shapedirs, betas, rest_joints, G, p):
    """Return where points (n,3) that hang on joints (n) are in a posed tree [m].

    template (n,3) and shapedirs (n,3,B) tell where they are at rest.
    """
    out = np.empty(template.shape)
    arm = np.empty(3)
    for i in range(template.shape[0]):
        j = joint[i]
        for c in range(3):
            arm[c] = template[i, c] - rest_joints[j, c]
            for b in range(betas.shape[0]):
                arm[c] += shapedirs[i, c, b] * betas[b]
        for r in range(3):
            out[i, r] = p[j, r]
            for c in range(3):
                out[i, r] += G[j, r, c] * arm[c]
    return out


@njit(cache=True, nogil=True)
def skin(v_shaped, bone_ids, bone_weights, G, p, rest_joints, scale, transl):
    """Return skinned vertices (n,3) [m] of shaped rest vertices (n,3)."""
    n, influences = bone_ids.shape
    offset = np.empty_like(p)
    for j in range(p.shape[0]):
        for r in range(3):
            offset[j, r] = p[j, r]
            for c in range(3):
                offset[j, r] -= G[j, r, c] * rest_joints[j, c]
    out = np.empty((n, 3))
    for i in range(n):
        x, y, z = 0.0, 0.0, 0.0
        a, b, c = v_shaped[i, 0], v_shaped[i, 1], v_shaped[i, 2]
        for k in range(influences):
            w = bone_weights[i, k]
            if w == 0.0:
                continue
            g = G[bone_ids[i, k]]
            o = offset[bone_ids[i, k]]
            x += w * (g[0, 0] * a + g[0, 1] * b + g[0, 2] * c + o[0])
            y += w * (g[1, 0] * a + g[1, 1] * b + g[1, 2] * c + o[1])
            z += w * (g[2, 0] * a + g[2, 1] * b + g[2, 2] * c + o[2])
        out[i, 0] = scale * x + transl[0]
        out[i, 1] = scale * y + transl[1]
        out[i, 2] = scale * z + transl[2]
    return out


@njit(cache=True, nogil=True)
def directional_jacobian(
    vertex, direction, v_shaped, shapedirs, bone_ids, bone_weights, G, p, e, rest_joints, parents,
    scale, out,
):
    """Fill rows `direction . d(vertex)/d(parameters)` into out (n, 3 + 72 + B + 1).

    Row i belongs to vertex[i] (an index into the vertex arrays) and direction[i] (3).
    """
    n_joints = p.shape[0]
    n_betas = shapedirs.shape[2]
    first_beta = 3 + 3 * n_joints
    weight_sum = np.zeros(n_joints)
    weighted = np.zeros((n_joints, 3))
    for i in range(vertex.shape[0]):
        v = vertex[i]
        nx, ny, nz = direction[i, 0], direction[i, 1], direction[i, 2]
        out[i, :] = 0.0
        out[i, 0], out[i, 1], out[i, 2] = nx, ny, nz
        weight_sum[:] = 0.0
        weighted[:] = 0.0
        blended_x, blended_y, blended_z = 0.0, 0.0, 0.0
        d0, d1, d2 = 0.0, 0.0, 0.0
        for k in range(bone_ids.shape[1]):
            w = bone_weights[v, k]
            if w == 0.0:
                continue
            m = bone_ids[v, k]
            lx = v_shaped[v, 0] - rest_joints[m, 0]
            ly = v_shaped[v, 1] - rest_joints[m, 1]
            lz = v_shaped[v, 2] - rest_joints[m, 2]
            x = G[m, 0, 0] * lx + G[m, 0, 1] * ly + G[m, 0, 2] * lz + p[m, 0]
            y = G[m, 1, 0] * lx + G[m, 1, 1] * ly + G[m, 1, 2] * lz + p[m, 1]
            z = G[m, 2, 0] * lx + G[m, 2, 1] * ly + G[m, 2, 2] * lz + p[m, 2]
            blended_x += w * x
            blended_y += w * y
            blended_z += w * z
            d0 += w * (G[m, 0, 0] * nx + G[m, 1, 0] * ny + G[m, 2, 0] * nz)
            d1 += w * (G[m, 0, 1] * nx + G[m, 1, 1] * ny + G[m, 2, 1] * nz)
            d2 += w * (G[m, 0, 2] * nx + G[m, 1, 2] * ny + G[m, 2, 2] * nz)
            for b in range(n_betas):
                along = nx * e[m, 0, b] + ny * e[m, 1, b] + nz * e[m, 2, b]
                out[i, first_beta + b] += w * along
            j = m
            while j >= 0:
                weight_sum[j] += w
                weighted[j, 0] += w * x
                weighted[j, 1] += w * y
                weighted[j, 2] += w * z
                j = parents[j]
        for b in range(n_betas):
            out[i, first_beta + b] += (
                d0 * shapedirs[v, 0, b] + d1 * shapedirs[v, 1, b] + d2 * shapedirs[v, 2, b])
            out[i, first_beta + b] *= scale
        out[i, first_beta + n_betas] = scale * (nx * blended_x + ny * blended_y + nz * blended_z)
        for j in range(n_joints):
            w = weight_sum[j]
            if w == 0.0:
                continue
            qx = weighted[j, 0] - w * p[j, 0]
            qy = weighted[j, 1] - w * p[j, 1]
            qz = weighted[j, 2] - w * p[j, 2]
            cx = scale * (qy * nz - qz * ny)
            cy = scale * (qz * nx - qx * nz)
            cz = scale * (qx * ny - qy * nx)
            parent = parents[j]
            if parent < 0:
                out[i, 3 + 3 * j], out[i, 4 + 3 * j], out[i, 5 + 3 * j] = cx, cy, cz
            else:
                g = G[parent]
                out[i, 3 + 3 * j] = g[0, 0] * cx + g[1, 0] * cy + g[2, 0] * cz
                out[i, 4 + 3 * j] = g[0, 1] * cx + g[1, 1] * cy + g[2, 1] * cz
                out[i, 5 + 3 * j] = g[0, 2] * cx + g[1, 2] * cy + g[2, 2] * cz


@njit(cache=True, nogil=True)
def attached_jacobian(carrier, posed, shapedirs, G, p, e, parents, scale, out):
    """Fill d(point)/d(parameters) into out (n, 3, 3 + 72 + B + 1) of points carried by one joint.

    posed (n,3) are the points before scale and translation, shapedirs (n,3,B) their rest shape.
    """
    n_betas = shapedirs.shape[2]
    first_beta = 3 + 3 * p.shape[0]
    axis = np.eye(3)
    out[:] = 0.0
    for i in range(carrier.shape[0]):
        j = carrier[i]
        for r in range(3):
            out[i, r, r] = 1.0
            out[i, r, first_beta + n_betas] = scale * posed[i, r]
            for b in range(n_betas):
                total = e[j, r, b]
                for c in range(3):
                    total += G[j, r, c] * shapedirs[i, c, b]
                out[i, r, first_beta + b] = scale * total
        while j >= 0:
            parent = parents[j]
            lx = scale * (posed[i, 0] - p[j, 0])
            ly = scale * (posed[i, 1] - p[j, 1])
            lz = scale * (posed[i, 2] - p[j, 2])
            for k in range(3):
                ax, ay, az = axis[k, 0], axis[k, 1], axis[k, 2]
                if parent >= 0:
                    ax, ay, az = G[parent, 0, k], G[parent, 1, k], G[parent, 2, k]
                out[i, 0, 3 + 3 * j + k] = ay * lz - az * ly
                out[i, 1, 3 + 3 * j + k] = az * lx - ax * lz
                out[i, 2, 3 + 3 * j + k] = ax * ly - ay * lx
            j = parent
