"""The same MLS-MPM step in Taichi, the fastest portable peer on the CPU.

Written from the published equations (Hu et al. 2018) in the form that Taichi's own examples use:
one parallel loop over particles with atomic adds, one over nodes, one over particles.
"""

import numpy as np


def build(case: dict, threads: int = 2):
    """A function `advance(steps)` that runs steps in place, and one that reads positions (N, 3).

    case: what `benchmarks.mpm.block_case` returns.
    """
    import taichi as ti

    ti.init(arch=ti.cpu, cpu_max_num_threads=threads, default_fp=ti.f32, log_level=ti.ERROR)
    count, nodes = len(case["position"]), case["nodes"]
    h, dt, corotated = case["spacing"], case["dt"], case["law"] == "fixed corotated"
    mass, volume = case["mass"], case["volume"]
    E, nu = case["youngs_modulus"], case["poisson_ratio"]
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    gravity = ti.Vector(case["gravity"])

    x = ti.Vector.field(3, ti.f32, count)
    v = ti.Vector.field(3, ti.f32, count)
    C = ti.Matrix.field(3, 3, ti.f32, count)
    F = ti.Matrix.field(3, 3, ti.f32, count)
    grid_v = ti.Vector.field(3, ti.f32, (nodes,) * 3)
    grid_m = ti.field(ti.f32, (nodes,) * 3)
    x.from_numpy(case["position"].astype(np.float32))
    v.from_numpy(case["velocity"].astype(np.float32))
    if "affine" in case:  # (N, 3, 3) [1/s]
        C.from_numpy(np.ascontiguousarray(case["affine"], np.float32))
    F.from_numpy(np.broadcast_to(np.eye(3, dtype=np.float32), (count, 3, 3)).copy())

    @ti.kernel
    def clear():
        for I in ti.grouped(grid_m):
            grid_v[I] = ti.Vector.zero(ti.f32, 3)
            grid_m[I] = 0.0

    @ti.kernel
    def to_grid():
        for p in x:
            base = (x[p] / h - 0.5).cast(int)
            fx = x[p] / h - base.cast(ti.f32)
            w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
            eye = ti.Matrix.identity(ti.f32, 3)
            J = F[p].determinant()
            stress = ti.Matrix.zero(ti.f32, 3, 3)
            if ti.static(corotated):
                U, _, V = ti.svd(F[p])
                R = U @ V.transpose()
                stress = 2 * mu * (F[p] - R) @ F[p].transpose() + lam * J * (J - 1) * eye
            else:
                stress = mu * (F[p] @ F[p].transpose() - eye) + lam * ti.log(J) * eye
            affine = mass * C[p] - (4 * dt * volume / h**2) * stress
            for offset in ti.static(ti.grouped(ti.ndrange(3, 3, 3))):
                d = (offset.cast(ti.f32) - fx) * h
                weight = w[offset[0]][0] * w[offset[1]][1] * w[offset[2]][2]
                grid_v[base + offset] += weight * (mass * v[p] + affine @ d)
                grid_m[base + offset] += weight * mass

    @ti.kernel
    def on_grid():
        for I in ti.grouped(grid_m):
            if grid_m[I] > 0:
                grid_v[I] = grid_v[I] / grid_m[I] + dt * gravity

    @ti.kernel
    def to_particle():
        for p in x:
            base = (x[p] / h - 0.5).cast(int)
            fx = x[p] / h - base.cast(ti.f32)
            w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
            new_v = ti.Vector.zero(ti.f32, 3)
            B = ti.Matrix.zero(ti.f32, 3, 3)
            for offset in ti.static(ti.grouped(ti.ndrange(3, 3, 3))):
                d = (offset.cast(ti.f32) - fx) * h
                weight = w[offset[0]][0] * w[offset[1]][1] * w[offset[2]][2]
                node = weight * grid_v[base + offset]
                new_v += node
                B += node.outer_product(d)
            v[p] = new_v
            C[p] = B * (4 / h**2)
            x[p] += dt * new_v
            F[p] += dt * C[p] @ F[p]

    def advance(steps: int) -> None:
        for _ in range(steps):
            clear()
            to_grid()
            on_grid()
            to_particle()
        ti.sync()

    return advance, x.to_numpy
