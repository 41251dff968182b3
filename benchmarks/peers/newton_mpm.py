"""Newton's implicit MPM (Warp, here on the CPU).

Run by an interpreter that has `newton`, which JAXPHYS_NEWTON_PYTHON names; see `remote`. Its law is
Hencky's (Hooke's law of the logarithmic strain); here without yield. A step is implicit, first
order in time, in float32. Settings are its defaults, with a drag of the air so small that it does
nothing; finer ones (`options`: "strain_basis", "velocity_basis", "tolerance", ...) change the
ringing cube by less than a percent, and cost two to five times. Driven particles have no mass, as
it wants them: where they are, the velocity of the grid is theirs.
"""

from importlib import metadata

import numpy as np
import warp as wp

from benchmarks.peers.protocol import Matter, Simulation, serve, turning

VACUUM = 1e-9  # drag [1/s] of matter: 0 divides by nothing at nodes without mass


def build(matter: Matter) -> Simulation:
    """The problem as a model of Newton's."""
    wp.config.quiet = True
    wp.init()
    import newton
    from newton.solvers import SolverImplicitMPM

    builder = newton.ModelBuilder()
    SolverImplicitMPM.register_custom_attributes(builder)
    builder.add_particles(
        pos=[wp.vec3(*x) for x in matter.position],
        vel=[wp.vec3(*v) for v in matter.velocity],
        mass=matter.mass.tolist(),
        radius=(0.5 * np.cbrt(matter.volume)).tolist(),  # its particles are cubes
    )
    solid = [told for told in matter.boundaries if told["type"] != "driven"]
    for told in solid:
        surface = newton.ModelBuilder.ShapeConfig(mu=told["friction"])
        if told["type"] == "floor":
            builder.add_ground_plane(height=told["height"], cfg=surface)
        else:
            place = wp.transform(wp.vec3(*told["centre"]), wp.quat_identity())
            hx, hy, hz = told["half_size"]
            builder.add_shape_box(body=-1, xform=place, hx=hx, hy=hy, hz=hz, cfg=surface)
    model = builder.finalize(device="cpu")
    model.set_gravity(matter.gravity)
    model.particle_max_velocity = 1e6  # else 1e3 m/s
    model.mpm.young_modulus.assign(matter.youngs_modulus.astype(np.float32))
    model.mpm.poisson_ratio.assign(matter.poisson_ratio.astype(np.float32))
    for name, value in ({"tensile_yield_ratio": 1.0} | matter.material).items():
        getattr(model.mpm, name).fill_(value)
    driven = [told for told in matter.boundaries if told["type"] == "driven"]
    for told in driven:
        model.particle_mass.numpy()[told["particles"]] = 0.0  # on the CPU the array itself
    density = float(np.max(matter.mass / matter.volume))
    settings = {"voxel_size": matter.spacing, "air_drag": VACUUM * density} | matter.options
    solver = SolverImplicitMPM(model, config=SolverImplicitMPM.Config(**settings))
    first, second = model.state(), model.state()
    states = [first, second]
    start = {
        "particle_q": matter.position,
        "particle_qd": matter.velocity,
    }
    more = {"particle_qd_grad": matter.affine, "particle_elastic_strain": matter.deformation}

    def reset() -> None:
        states[:] = [first, second]
        for name, value in start.items():
            getattr(first, name).assign(value.astype(np.float32))
        for name, value in more.items():
            getattr(first.mpm, name).assign(value.astype(np.float32))
        first.mpm.particle_stress.zero_()
        first.mpm.particle_Jp.fill_(1.0)

    def advance() -> None:
        for step in range(matter.steps):
            for told in driven:
                drive(states[0], told, step * matter.dt)
            solver.step(states[0], states[1], None, None, matter.dt)
            if solid:
                solver.project_outside(states[1], states[1], matter.dt)
            states.reverse()
        wp.synchronize()

    def drive(state, told: dict, time: float) -> None:
        chosen = told["particles"]
        arrays = (state.particle_q, state.particle_qd, state.mpm.particle_qd_grad)
        for array, value in zip(arrays, turning(told, matter.position[chosen], time), strict=True):
            array.numpy()[chosen] = value

    def end() -> tuple[np.ndarray, ...]:
        state = states[0]
        return (
            state.particle_q.numpy(),
            state.particle_qd.numpy(),
            state.mpm.particle_qd_grad.numpy(),
            state.mpm.particle_elastic_strain.numpy(),
        )

    versions = {name: metadata.version(name) for name in ("newton", "warp-lang")}
    return Simulation(reset, advance, end, matter.steps, "Hencky", versions)


if __name__ == "__main__":
    serve(build)
