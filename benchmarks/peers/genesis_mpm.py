"""Genesis's MPM (its own compiler, here on the CPU).

Run by an interpreter that has `genesis-world`, which JAXPHYS_GENESIS_PYTHON names; see `remote`.
Explicit MLS-MPM steps in float32, laws `corotation` (fixed corotated) and `neohooken` (neo-Hookean;
also taken for Hencky's, which it has not). All particles have one volume, and those of one E, nu
and density are an entity.
"""

from importlib import metadata

import genesis as gs
import numpy as np

from benchmarks.peers.protocol import Matter, Simulation, serve

MODELS = {"fixed corotated": "corotation", "neo-Hookean": "neohooken", "Hencky": "neohooken"}
MOST_SUBSTEPS = 32  # a step's substeps are all kept in memory


def build(matter: Matter) -> Simulation:
    """The problem as a scene of Genesis's."""
    size = float(np.cbrt(matter.volume[0]))
    if np.ptp(matter.volume) > 1e-6 * matter.volume[0]:
        raise ValueError("volume: all particles have one in Genesis")
    if not gs._initialized:
        gs.init(backend=gs.cpu, precision="32", logging_level="warning")
    # What divides the steps, so that they are as long as ours.
    substeps = max(n for n in range(1, MOST_SUBSTEPS + 1) if matter.steps % n == 0)
    spacing, margin = matter.spacing, 4  # cells; Genesis keeps three for itself
    scene = gs.Scene(
        sim_options=gs.options.SimOptions(
            dt=substeps * matter.dt, substeps=substeps, gravity=matter.gravity
        ),
        mpm_options=gs.options.MPMOptions(
            grid_density=1 / spacing,
            particle_size=size,
            lower_bound=(-margin * spacing,) * 3,
            upper_bound=tuple((n - 1 + margin) * spacing for n in matter.nodes),
        ),
        show_viewer=False,
    )
    columns = (matter.youngs_modulus, matter.poisson_ratio, matter.mass / matter.volume)
    # Alike to six digits is alike: numbers may have been through float32.
    rows = [[float(f"{value:.6g}") for value in row] for row in zip(*columns, strict=True)]
    kinds, kind = np.unique(rows, axis=0, return_inverse=True)
    order = np.argsort(kind.ravel(), kind="stable")
    for index, (E, nu, rho) in enumerate(kinds):
        scene.add_entity(
            morph=gs.morphs.Nowhere(n_particles=int(np.sum(kind == index))),
            material=gs.materials.MPM.Elastic(
                E=float(E), nu=float(nu), rho=float(rho), model=MODELS[matter.law]
            ),
        )
    scene.build()
    solver = scene.sim.mpm_solver
    start = solver.get_state(0)
    # It moves F on by C at the start of a step, where others do at the end.
    turn = np.eye(3) + matter.dt * matter.affine
    values = {
        "pos": matter.position,
        "vel": matter.velocity,
        "C": matter.affine,
        "F": np.linalg.solve(turn, matter.deformation),
    }
    for name, value in values.items():
        tensor = getattr(start, name)
        tensor.copy_(tensor.new_tensor(value[order].astype(np.float32))[None])
    start.active.fill_(True)
    start.Jp.fill_(1.0)

    def reset() -> None:
        scene.reset()
        solver.set_state(0, start)

    def advance() -> None:
        for _ in range(matter.steps // substeps):
            scene.step()
        end()

    def end() -> tuple[np.ndarray, ...]:
        state = solver.get_state(scene.sim.cur_substep_local)
        x, v, C, F = (getattr(state, name)[0].cpu().numpy() for name in values)
        F = (np.eye(3) + matter.dt * C) @ F
        back = np.argsort(order)
        return x[back], v[back], C[back], F[back]

    versions = {name: metadata.version(name) for name in ("genesis-world", "quadrants", "torch")}
    law = "neo-Hookean" if matter.law == "Hencky" else matter.law
    return Simulation(reset, advance, end, matter.steps, law, versions)


if __name__ == "__main__":
    serve(build)
