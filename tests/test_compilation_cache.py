"""The suite's compilation cache may be damaged: a full disk, a killed process, another version."""

from pathlib import Path

import jax
import jax.numpy as jnp
import pytest
from jax.experimental.compilation_cache import compilation_cache


@pytest.fixture
def cache(tmp_path):
    """An empty cache that keeps every program, for one test."""
    names = ("jax_compilation_cache_dir", "jax_persistent_cache_min_compile_time_secs")
    before = {name: getattr(jax.config, name) for name in names}
    for name, value in zip(names, (str(tmp_path), 0.0), strict=True):
        jax.config.update(name, value)
    compilation_cache.reset_cache()
    yield tmp_path
    for name, value in before.items():
        jax.config.update(name, value)
    compilation_cache.reset_cache()


def compiled_anew() -> float:
    """A program that no other test has, through the cache: each call makes another function."""
    return float(jax.jit(lambda x: jnp.sin(x) * 0.362436)(jnp.float32(0.5)))


def damage(folder: Path) -> int:
    entries = [file for file in folder.rglob("*-cache") if file.is_file()]
    for file in entries:
        file.write_bytes(file.read_bytes()[:40])
    return len(entries)


def test_a_damaged_cache_fails_no_test(cache):
    expected = compiled_anew()
    assert damage(cache) > 0
    assert compiled_anew() == expected
    damage(cache)
    with pytest.warns(UserWarning, match="^Error reading persistent compilation cache entry"):
        assert compiled_anew() == expected
