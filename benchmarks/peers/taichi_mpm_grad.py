"""The gradient of the same MLS-MPM rollout by Taichi's automatic differentiation.

The pattern of DiffTaichi (Hu et al. 2020): fields hold every step's particles and nodes, so that no
kernel overwrites what another read, and the transposes that Taichi makes of the kernels run in
reverse order. Nothing is computed twice; memory grows with the number of steps. Sums over the 27
nodes go axis by axis: written as in the forward peer, Taichi takes minutes to compile their
transposes. Neo-Hookean only: Taichi's derivative of its singular value decomposition is not defined
at equal singular values, that is at rest.
"""

import numpy as np


def field_bytes(count: int, nodes: int, steps: int) -> int:
    """Bytes of the float32 fields with their gradients: 24 numbers a particle, 7 a node."""
    return 2 * 4 * (24 * count * (steps + 1) + 7 * nodes**3 * steps)


def build(case: dict, steps: int, threads: int = 2):
    """A function that runs `steps` steps forth and back and returns the mean square coordinate,
    and one that reads its gradients by Young's modulus (N,) [m^2/Pa] and by the initial velocity
    (N, 3) [m s].

    case: what `benchmarks.mpm.block_case` returns. The first call compiles for about a minute.
    """
    import taichi as ti

    if case["law"] != "neo-Hookean":
        raise ValueError(f"law {case['law']!r}: this peer differentiates neo-Hookean only")
    # advanced_optimization=False compiles in a third of the time, but the gradients of dot products
    # are then silently zero (Taichi 1.7.4).
    ti.init(arch=ti.cpu, cpu_max_num_threads=threads, default_fp=ti.f32, log_level=ti.ERROR)
    count, nodes = len(case["position"]), case["nodes"]
    h, dt, nu = case["spacing"], case["dt"], case["poisson_ratio"]
    mass, volume = case["mass"], case["volume"]
    gravity = ti.Vector([0.0, 0.0, -9.8])

    def vectors(*shape):
        return ti.Vector.field(3, ti.f32, shape, needs_grad=True)

    def matrices(*shape):
        return ti.Matrix.field(3, 3, ti.f32, shape, needs_grad=True)

    x, v = vectors(steps + 1, count), vectors(steps + 1, count)
    C, F = matrices(steps + 1, count), matrices(steps + 1, count)
    momentum, grid_v = vectors(steps, nodes, nodes, nodes), vectors(steps, nodes, nodes, nodes)
    grid_m = ti.field(ti.f32, (steps, nodes, nodes, nodes), needs_grad=True)
    modulus = ti.field(ti.f32, count, needs_grad=True)
    loss = ti.field(ti.f32, (), needs_grad=True)
    start_x, start_v = ti.Vector.field(3, ti.f32, count), ti.Vector.field(3, ti.f32, count)
    start_x.from_numpy(case["position"].astype(np.float32))
    start_v.from_numpy(case["velocity"].astype(np.float32))
    modulus.fill(case["youngs_modulus"])

    @ti.kernel
    def start():
        for p in range(count):
            x[0, p] = start_x[p]
            v[0, p] = start_v[p]
            C[0, p] = ti.Matrix.zero(ti.f32, 3, 3)
            F[0, p] = ti.Matrix.identity(ti.f32, 3)

    @ti.kernel
    def to_grid(t: ti.i32):
        for p in range(count):
            base = (x[t, p] / h - 0.5).cast(int)
            fx = x[t, p] / h - base.cast(ti.f32)
            w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
            mu = modulus[p] / (2 * (1 + nu))
            lam = modulus[p] * nu / ((1 + nu) * (1 - 2 * nu))
            eye = ti.Matrix.identity(ti.f32, 3)
            log_volume = ti.log(F[t, p].determinant())
            stress = mu * (F[t, p] @ F[t, p].transpose() - eye) + lam * log_volume * eye
            affine = h * (mass * C[t, p] - (4 * dt * volume / h**2) * stress)
            corner = mass * v[t, p] - affine @ fx
            for i in ti.static(range(3)):
                plane = corner + i * affine[:, 0]
                for j in ti.static(range(3)):
                    row = plane + j * affine[:, 1]
                    share = w[i][0] * w[j][1]
                    for k in ti.static(range(3)):
                        weight = share * w[k][2]
                        node = base + ti.Vector([i, j, k])
                        grid_m[t, node[0], node[1], node[2]] += weight * mass
                        momentum[t, node[0], node[1], node[2]] += weight * (row + k * affine[:, 2])

    @ti.kernel
    def on_grid(t: ti.i32):
        for i, j, k in ti.ndrange(nodes, nodes, nodes):
            if grid_m[t, i, j, k] > 0:
                grid_v[t, i, j, k] = momentum[t, i, j, k] / grid_m[t, i, j, k] + dt * gravity

    @ti.kernel
    def to_particle(t: ti.i32):
        for p in range(count):
            base = (x[t, p] / h - 0.5).cast(int)
            fx = x[t, p] / h - base.cast(ti.f32)
            w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
            new_v = ti.Vector.zero(ti.f32, 3)
            # First moments about the corner of the stencil, one for each axis.
            by_x = ti.Vector.zero(ti.f32, 3)
            by_y = ti.Vector.zero(ti.f32, 3)
            by_z = ti.Vector.zero(ti.f32, 3)
            for i in ti.static(range(3)):
                plane = ti.Vector.zero(ti.f32, 3)
                for j in ti.static(range(3)):
                    first = grid_v[t, base[0] + i, base[1] + j, base[2]]
                    middle = w[1][2] * grid_v[t, base[0] + i, base[1] + j, base[2] + 1]
                    last = w[2][2] * grid_v[t, base[0] + i, base[1] + j, base[2] + 2]
                    row = w[j][1] * (w[0][2] * first + middle + last)
                    plane += row
                    if ti.static(j > 0):
                        by_y += (j * w[i][0]) * row
                    by_z += (w[i][0] * w[j][1]) * (middle + 2 * last)
                new_v += w[i][0] * plane
                if ti.static(i > 0):
                    by_x += (i * w[i][0]) * plane
            moments = ti.Matrix.cols([by_x, by_y, by_z]) - new_v.outer_product(fx)
            new_C = moments * (4 / h)
            v[t + 1, p] = new_v
            C[t + 1, p] = new_C
            x[t + 1, p] = x[t, p] + dt * new_v
            F[t + 1, p] = F[t, p] + dt * new_C @ F[t, p]

    @ti.kernel
    def mean_square():
        for p in range(count):
            loss[None] += x[steps, p].norm_sqr() / (3 * count)

    def value_and_gradient() -> float:
        for field in (momentum, grid_v, grid_m, loss):
            field.fill(0)
        for field in (x, v, C, F, momentum, grid_v, grid_m, modulus):
            field.grad.fill(0)
        start()
        for t in range(steps):
            to_grid(t)
            on_grid(t)
            to_particle(t)
        mean_square()
        loss.grad[None] = 1.0
        mean_square.grad()
        for t in reversed(range(steps)):
            to_particle.grad(t)
            on_grid.grad(t)
            to_grid.grad(t)
        ti.sync()
        return loss[None]

    def gradients() -> tuple[np.ndarray, np.ndarray]:
        return modulus.grad.to_numpy(), v.grad.to_numpy()[0]

    return value_and_gradient, gradients
