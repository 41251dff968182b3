"""Cook's membrane locks without the mean volume, and does not with it."""

import numpy as np
import pytest

from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.mean_volume import at_mean_volume
from jaxphys.problems.membrane import (
    FORCE,
    LEFT,
    RIGHT,
    TIP,
    WIDTH,
    at_rest,
    membrane,
    tip_rise,
)


def test_the_panel_has_its_area_and_its_load():
    panel = membrane(8)
    area = WIDTH * (LEFT + RIGHT) / 2
    np.testing.assert_allclose(panel.model.volume.sum(), area, rtol=1e-12)
    pull = panel.model.boundaries[1]
    chosen = np.asarray(pull.chosen).reshape(panel.shape)
    assert chosen[-1].all() and not chosen[:-1].any()
    share = pull.loads(panel.model, panel.config.grid)["share"]
    np.testing.assert_allclose(FORCE * share.sum(), FORCE, rtol=1e-12)
    shifted = panel.state._replace(position=panel.state.position.at[1].add(0.25))
    np.testing.assert_allclose(tip_rise(panel, shifted), 0.25, rtol=1e-10)


@pytest.mark.parametrize(
    ("cells", "locked", "off"),
    [(6, 0.65, 0.12), (16, 0.87, 0.05)],
)
@pytest.mark.slow
def test_tip(cells, locked, off):
    """Shares of the rise that F-bar elements have (de Souza Neto et al. 1996)."""
    plain, shared = (
        tip_rise(panel, at_rest(panel))
        for panel in (membrane(cells), membrane(cells, at_mean_volume(NEO_HOOKEAN)))
    )
    assert plain < locked * TIP
    assert abs(shared - TIP) < off * TIP
