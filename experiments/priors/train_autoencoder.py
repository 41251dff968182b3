"""Trains the autoencoder of surfaces.

    python -m experiments.priors.train_autoencoder --data PREPARED --run RUN

Stop it at any time; the same command goes on from the newest checkpoint.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from experiments.priors import records
from experiments.priors.clouds import Cloud, cloud_source, held_out_clouds
from experiments.priors.dots import dot_rows
from experiments.priors.fields import field_targets
from experiments.priors.training import Task, arguments, train
from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig, Field, ShapeAutoencoder
from jaxphys.guidance.bundled.surface import surface_points
from jaxphys.networks.parameters import with_parameters

DENSE = 8192  # points of a cloud that distances are measured to
NEAR = 0.03  # colours count where the surface is as near as that, object lengths
WITHOUT_NORMALS = 0.25  # share of clouds read without, as guidance has them
NOISE = 0.1  # of the latents in training, whose mean square is 1: near ones decode alike
SHOWN, SHOWN_POINTS = 12, 3000


def reconstruct(network: ShapeAutoencoder, batch: dict[str, Array], key: Array | None) -> Field:
    latents = network.encode(batch["points"], batch["normals"], batch["colours"])
    if key is not None:
        latents = latents + NOISE * jax.random.normal(key, latents.shape)
    return network.decode(latents, batch["places"])


def errors(network: ShapeAutoencoder, batch: dict[str, Array], field: Field) -> dict[str, Array]:
    """Mean absolute errors: of distances everywhere and near the surface, of colours near it."""
    near = jnp.abs(batch["distance"] + network.config.thickness) < NEAR
    share = jnp.maximum(near.mean(), 1e-6)
    distance = jnp.abs(field.distance - batch["distance"])
    colour = jnp.abs(field.colour - batch["colour"]).mean(-1)
    return {
        "distance": distance.mean(),
        "near_distance": (distance * near).mean() / share,
        "near_colour": (colour * near).mean() / share,
    }


def loss(network: ShapeAutoencoder, batch: dict[str, Array], key: Array) -> Array:
    found = errors(network, batch, reconstruct(network, batch, key))
    return 10 * (found["distance"] + found["near_distance"]) + found["near_colour"]


def main() -> None:
    parser = arguments(__doc__, batch=16, steps=16_000)
    parser.set_defaults(learning_rate=4e-3)
    parser.add_argument("--points", type=int, default=4096, help="points that are encoded")
    parser.add_argument("--places", type=int, default=2048, help="places asked of each object")
    parser.add_argument("--kinds", nargs="*", help="of these parametric kinds alone")
    options = parser.parse_args()
    config = AutoencoderConfig(dtype=options.dtype)
    data = records.load(options.data) if options.data else None
    source = cloud_source(data, options.kinds, DENSE)

    def gather(clouds: list[Cloud], rng: np.random.Generator) -> dict[str, np.ndarray]:
        rows = []
        for cloud in clouds:
            places, distance, colour = field_targets(cloud, options.places, rng, config)
            at = rng.permutation(len(cloud.points))[: options.points]
            read = {name: getattr(cloud, name)[at] for name in ("points", "normals", "colours")}
            if rng.random() < WITHOUT_NORMALS:
                read["normals"] = np.zeros_like(read["normals"])
            rows.append(read | {"places": places, "distance": distance, "colour": colour})
        return {key: np.stack([row[key] for row in rows]).astype(np.float32) for key in rows[0]}

    clouds = held_out_clouds(data, options.kinds, DENSE)
    held_out = gather(clouds, np.random.default_rng(1))
    module = ShapeAutoencoder(config, rngs=nnx.Rngs(options.seed))

    @jax.jit
    def held_out_errors(parameters: dict[str, Array], batch: dict[str, Array]):
        network = with_parameters(module, parameters)
        return errors(network, batch, reconstruct(network, batch, None))

    def evaluate(parameters: dict[str, Array]) -> dict[str, dict[str, float]]:
        found = held_out_errors(parameters, held_out)
        return {"held_out": {name: round(float(value), 5) for name, value in found.items()}}

    def picture(network: ShapeAutoencoder) -> np.ndarray:
        """Held-out objects, and below them what is decoded of them."""
        read = [held_out[name][:SHOWN] for name in ("points", "normals", "colours")]
        decoded = []
        for latents in network.encode(*read):
            try:
                points, _, colours = surface_points(network, latents, SHOWN_POINTS)
            except InputError:  # early in training there may be none
                points, colours = np.zeros((1, 3)), np.zeros((1, 3))
            decoded.append((points, colours))
        true = [(cloud.points[::2], cloud.colours[::2]) for cloud in clouds[:SHOWN]]
        return np.concatenate([dot_rows(true), dot_rows(decoded)])

    task = Task(
        module=module,
        draw=lambda rng, count: gather(source(rng, count), rng),
        loss=loss,
        evaluate=evaluate,
        picture=picture,
    )
    train(task, options)


if __name__ == "__main__":
    main()
