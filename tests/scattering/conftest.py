import jax
import pytest


@pytest.fixture
def double_precision():
    """JAX with 64 bits, as the solver sets it around its near pairs."""
    with jax.enable_x64(True):
        yield
