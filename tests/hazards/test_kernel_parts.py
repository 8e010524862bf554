"""Kernels that only other kernels call: compiled once, into their callers, nowhere else."""

import pytest

from pbrdf.kernels import caching, from_python, jit


@pytest.fixture
def pair(monkeypatch):
    """Return a part and a kernel that calls it, not kept from an earlier run."""
    monkeypatch.setattr(caching, "_KEPT", False)

    @jit(part=True)
    def tripled(x):
        return 3 * x

    @jit
    def by_constants(x):
        return tripled(2) + 10 * tripled(5) + 100 * tripled(x)

    assert by_constants(7) == 6 + 150 + 2100
    return tripled, by_constants


def test_a_part_is_compiled_once_for_all_constants(pair):
    part, _ = pair
    assert len(part.overloads) == 1


def test_a_part_leaves_no_machine_code_of_its_own(pair):
    """A kernel has its name among the symbols of its object file; a part has none."""
    part, kernel = pair
    for compiled, there in (kernel, True), (part, False):
        (result,) = compiled.overloads.values()
        code = result.library._get_compiled_object()
        assert (result.fndesc.llvm_func_name.encode() in code) is there


def test_a_part_is_called_from_python_by_an_entry_only(pair):
    part, _ = pair
    with pytest.raises(TypeError, match="from_python"):
        part(1)
    assert from_python(part)(4) == 12
