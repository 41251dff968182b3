"""`jaxphys.render` is a package and a function, whatever was imported before."""

import importlib
import subprocess
import sys

import numpy as np

import jaxphys
from jaxphys.core.splats import Splats

ONE = Splats(
    means=np.zeros((1, 3), np.float32),
    covariances=0.01 * np.eye(3, dtype=np.float32)[None],
    opacities=np.ones(1, np.float32),
    colours=np.ones((1, 3), np.float32),
)


def test_called_before_and_after_the_package_is_imported():
    camera = jaxphys.orbit((0.0, 0.0, 0.0), 2.0, 0.0, 0.0, width=16, height=16)
    pictures = [jaxphys.render(ONE, camera).colour]
    package = importlib.import_module("jaxphys.render")
    pictures += [jaxphys.render(ONE, camera).colour, package.render(ONE, camera).colour]
    assert np.asarray(pictures[0]).max() > 0.5
    np.testing.assert_array_equal(pictures[0], pictures[1])
    np.testing.assert_array_equal(pictures[0], pictures[2])
    assert package.Camera is type(camera)


def test_every_name_is_the_same_when_asked_again():
    """In a process of its own, in which nothing has been imported yet."""
    program = (
        "import jaxphys\n"
        "for name in dir(jaxphys):\n"
        "    first, second = getattr(jaxphys, name), getattr(jaxphys, name)\n"
        "    assert first is second or callable(second) == callable(first), name\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
