"""A law of one's own: what it gets, and what is refused, each time for one flaw."""

import dataclasses
import json
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxphys
from jaxphys.cli.listing import materials_text
from jaxphys.core.errors import InputError
from jaxphys.mpm import MATERIALS, Parameter, get_material, register_material
from jaxphys.mpm.materials import catalogue
from jaxphys.mpm.materials.deriving import law_of_gradient, law_of_stretches, law_of_volume
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    NEO_HOOKEAN,
    hencky_density,
    lame,
    neo_hookean_energy,
    neo_hookean_principal_energy,
)
from jaxphys.mpm.materials.fibres import FIBRES, fibre_energy
from jaxphys.mpm.materials.plasticity import PERFECT_VON_MISES, UNIAXIAL
from jaxphys.mpm.stepping.bounds import moduli_of, rest_moduli

from .driver import drive, values_of

NUMBERS = {"youngs_modulus": 1e4, "poisson_ratio": 0.3}
DEFAULTS = NUMBERS | {"density": 300.0}


@pytest.fixture(autouse=True)
def catalogue_as_it_was():
    before = dict(catalogue._materials)
    yield
    catalogue._materials.clear()
    catalogue._materials.update(before)


def states():
    random = np.random.default_rng(2)
    F = np.eye(3)[:, :, None] + 0.15 * random.normal(size=(3, 3, 12))
    F[:, :, 0], F[:, :, 1] = np.eye(3), np.diag([1.2, 1.2, 0.9])
    return jnp.asarray(F)


def many(law, numbers, count=12):
    return law.prepare({name: jnp.full(count, numbers[name]) for name in law.parameters})


BY_STRETCHES = law_of_stretches("by stretches", ELASTIC_PARAMETERS, neo_hookean_principal_energy)
BY_GRADIENT = law_of_gradient("by gradient", ELASTIC_PARAMETERS, neo_hookean_energy)


@pytest.mark.parametrize("law", [BY_STRETCHES, BY_GRADIENT], ids=repr)
def test_stress_bounds_and_gradients_follow_from_the_energy(law):
    """Neo-Hookean's in closed form, at rest and at equal stretches, too."""
    weight = np.random.default_rng(5).normal(size=(3, 3, 12))
    none = jnp.zeros((0, 12))

    @partial(jax.jit, static_argnums=0)
    def look(law, F, E):
        def stress(F, E):
            values = {"youngs_modulus": E, "poisson_ratio": jnp.full(12, 0.3)}
            return law.update(law.prepare(values), F, none, 1e-3)[1]

        values = many(law, NUMBERS)
        by_hand = jax.grad(lambda F, E: jnp.sum(weight * stress(F, E)), (0, 1))(F, E)
        return (
            stress(F, E),
            law.energy(values, F, none),
            moduli_of(law, values, F),
            rest_moduli(law, values, jnp.ones(12)),
            by_hand,
        )

    ours, theirs = (look(one, states(), jnp.full(12, 1e4)) for one in (law, NEO_HOOKEAN))
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_allclose(
            a, np.broadcast_to(b, a.shape), rtol=1e-6, atol=1e-8 * np.abs(b).max()
        )


def test_a_return_map_of_one_s_own():
    """Von Mises' in a dozen lines, with what flowed in the history, against the package's."""

    def onto_cylinder(p, e, history, dt):
        mu, _ = lame(p)
        deviator = e - jnp.mean(e, axis=0)
        norm = jnp.sqrt(jnp.sum(deviator**2, axis=0) + 1e-30)
        flow = jnp.maximum(norm - UNIAXIAL * p["yield_stress"] / (2 * mu), 0)
        return e - flow * deviator / norm, history + UNIAXIAL * flow

    law = law_of_stretches(
        "clay",
        (*ELASTIC_PARAMETERS, PERFECT_VON_MISES.declared[-1]),
        lambda p, s: hencky_density(*lame(p), jnp.log(s)),
        return_map=onto_cylinder,
        history={"flowed": 0.0},
    )
    numbers = NUMBERS | {"yield_stress": 50.0}
    rates = np.random.default_rng(0).normal(size=(40, 3, 3))
    tau, flowed, _ = drive(law, values_of(law, numbers), rates, 1e-3)
    theirs, _, _ = drive(PERFECT_VON_MISES, values_of(PERFECT_VON_MISES, numbers), rates, 1e-3)
    np.testing.assert_allclose(tau, theirs, rtol=1e-9, atol=1e-8)
    assert law.plastic and (np.diff(flowed[:, 0]) >= 0).all() and flowed[-1, 0] > 0
    register_material("clay", law, "of one's own", yield_stress=50.0, **DEFAULTS)


def test_a_registered_material_is_known_everywhere():
    give = Parameter("give", "how much it gives", "Pa")
    law = law_of_volume("one's own gas", (give,), lambda p, J: p["give"] * (J - 1 - jnp.log(J)))
    made = register_material("gas", law, "fills what there is", give=3e3, density=2.0)
    assert MATERIALS["gas"] is made is get_material("gas")
    listed = json.loads(materials_text(as_json=True))["gas"]
    assert listed["parameters"]["give"]["meaning"] == "how much it gives"
    assert "how much it gives" in materials_text()
    scene = jaxphys.default_scene("gas", spacing=0.12)
    assert scene.objects[0].material == "gas"
    from jaxphys.pipeline.plan import make_plan

    plan = make_plan(dataclasses.replace(scene, width=64, height=48))
    assert "law one's own gas" in plan.included and plan.substep > 0


@pytest.mark.slow
def test_what_depends_on_directions_must_say_so():
    declared = FIBRES.declared
    defaults = {n: MATERIALS["muscle"].defaults[n] for n in (*FIBRES.parameters, "density")}
    wrong = law_of_gradient("fibres", declared, fibre_energy)
    with pytest.raises(InputError, match=r"differ by .* isotropic=False"):
        register_material("meat", wrong, "", **defaults)
    right = law_of_gradient("fibres", declared, fibre_energy, isotropic=False)
    register_material("meat", right, "", **defaults)
    values = values_of(right, defaults)
    F = jnp.asarray(np.diag([1.2, 0.95, 1.0]))[..., None]
    np.testing.assert_allclose(
        right.moduli(values, F)[1], FIBRES.moduli(FIBRES.prepare(values), F)[1], rtol=1e-9
    )


def with_update(change):
    """Neo-Hookean whose update is changed."""

    def update(p, F, history, dt):
        return change(*NEO_HOOKEAN.update(p, F, history, dt), p)

    return dataclasses.replace(NEO_HOOKEAN, name="flawed", update=update)


def skewed(F, tau, history, p):
    return F, tau.at[0, 1].add(1e-3 * tau[0, 0]), history


def larger(F, tau, history, p):
    return F, 1.01 * tau, history


def endless(F, tau, history, p):
    return F, tau / jnp.sum(tau**2, axis=(0, 1)), history


def longer(F, tau, history, p):
    return F, tau, jnp.zeros((1, *tau.shape[2:]))


def flat(F, tau, history, p):
    return F, tau[0], history


def kinked(F, tau, history, p):
    return (
        F,
        tau * (1 + 0 * jnp.sqrt(jnp.sum((F - jnp.eye(3)[..., None]) ** 2, axis=(0, 1)))),
        history,
    )


def test_the_law_that_the_flawed_ones_are_made_of_is_sound():
    register_material(
        "sound", with_update(lambda F, tau, history, p: (F, tau, history)), "", **DEFAULTS
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (skewed, r"not symmetric: two entries differ by [\d.e+-]+ Pa"),
        (larger, r"energy and stress disagree by [\d.e+-]+ Pa"),
        (endless, "the stress is nan at F = I"),
        (longer, r"the history has shape \(1, 10\), need \(0, 10\)"),
        (flat, r"the stress has shape \(3, 10\), need \(3, 3, 10\)"),
        (kinked, "the gradient of the stress is nan at F = I"),
    ],
)
def test_flawed_laws_are_refused_with_the_number(change, message):
    with pytest.raises(InputError, match=message) as error:
        register_material("flawed", with_update(change), "", **DEFAULTS)
    assert str(error.value).startswith("register_material: flawed") and "flawed" not in MATERIALS
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "jelly"}, "there is such a material already"),
        ({"poisson_ratio": 0.5}, "poisson_ratio is 0.5, must be between -1 and 0.5"),
        ({"density": 0.0}, "density is 0 kg/m.3, must be > 0"),
        ({"youngs_modulus": None}, "no default for youngs_modulus, > 0 Pa"),
        ({"youngs_modulos": 1.0}, "reads no youngs_modulos; did you mean 'youngs_modulus'"),
        ({"law": BY_STRETCHES, "other": Parameter("density", "how dense", "")}, "already means"),
    ],
)
def test_names_and_defaults_are_held_against_what_is_declared(arguments, message):
    arguments = dict(arguments)
    law = arguments.pop("law", NEO_HOOKEAN)
    if other := arguments.pop("other", None):
        law = dataclasses.replace(law, declared=(*law.declared, other))
    name = arguments.pop("name", "one's own")
    defaults = {k: v for k, v in (DEFAULTS | arguments).items() if v is not None}
    with pytest.raises(InputError, match=message):
        register_material(name, law, "", **defaults)


def test_a_law_that_nothing_bounds_is_refused():
    unbounded = dataclasses.replace(NEO_HOOKEAN, name="endless", principal_energy=None)
    with pytest.raises(InputError, match="nothing bounds the time step"):
        register_material("endless", unbounded, "", **DEFAULTS)
