"""Matrices per second of the analytical model beside other ways to get them, in one run."""

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import Material, MicrofacetModel
from pbrdf.analytic.symbolic import rebind
from pbrdf.kernels.microfacet import facet, microfacet

pytestmark = pytest.mark.bench

COUNT = 1_000_000
MODEL = MicrofacetModel(Material(1.5), 0.3)


def geometries(count=COUNT):
    rng = np.random.default_rng(2)
    return (*rng.uniform(0, np.pi / 2, (2, count)), rng.uniform(-np.pi, np.pi, count))


def best_seconds(function, repeats=5):
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def numpy_form(chunk=4096):
    """The same source over NumPy arrays, in chunks that stay in cache."""
    from scipy.special import erf

    operations = {
        "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "sin": np.sin, "cos": np.cos,
        "erf": erf, "atan2": np.arctan2, "abs": np.abs, "select": np.where,
    }  # fmt: skip
    copies = {}
    directions = rebind(facet.directions, operations, copies)
    brdf = rebind(microfacet.microfacet_brdf, operations, copies)
    surface = MODEL.surface()

    def part(theta_i, theta_s, dphi, out):
        way = directions(theta_i, theta_s, dphi, 1.0, 0.0)
        rows = brdf(way, 1.5, 0.0, surface, 0.0)
        for i in range(4):
            for j in range(4):
                out[:, i, j] = rows[i][j]

    def evaluate(theta_i, theta_s, dphi):
        out = np.empty((theta_i.size, 4, 4))
        pieces = [slice(k, k + chunk) for k in range(0, theta_i.size, chunk)]
        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            list(pool.map(lambda p: part(theta_i[p], theta_s[p], dphi[p], out[p]), pieces))
        return out

    return evaluate


def test_rate_of_the_compiled_model_and_of_numpy():
    angles = geometries()
    compiled = COUNT / best_seconds(lambda: MODEL.brdf(*angles))
    room = np.empty((COUNT, 4, 4))
    reused = COUNT / best_seconds(lambda: MODEL.brdf(*angles, out=room))
    few = tuple(a[:100_000] for a in angles)
    evaluate = numpy_form()
    with np.errstate(all="ignore"):
        assert_allclose(
            evaluate(*few)[::999], MODEL.brdf(*few)[::999], rtol=1e-9, atol=1e-30
        )
        plain = len(few[0]) / best_seconds(lambda: evaluate(*few))
    cores = len(os.sched_getaffinity(0))
    print(f"\ncompiled {compiled / 1e6:.1f} million matrices/s on {cores} cores")
    print(f"into an array used again (out=) {reused / 1e6:.1f}")
    print(f"NumPy    {plain / 1e6:.2f} million matrices/s; ratio {compiled / plain:.1f}")


def test_rate_of_scatmech():
    scatmech = pytest.importorskip("pySCATMECH.brdf")
    angles = geometries(20_000)
    model = scatmech.BRDF_Model(
        "Shadowed_Facet_BRDF_Model",
        {
            "lambda": "0.5", "type": "0", "substrate": "(1.5,0)",
            "sdf": "Gaussian_Slope_Distribution_Function", "sdf.s": str(0.3 * 2**0.5),
            "shadow": "Smith_Shadow_Function", "shadow.w": str(0.3 * 2**0.5),
        },
    )  # fmt: skip
    theta_i, theta_s, dphi = (a.tolist() for a in angles)

    def evaluate():
        for ti, ts, dp in zip(theta_i, theta_s, dphi, strict=True):
            model.MuellerBRDF(ti, ts, dp + np.pi, 0)

    other = len(theta_i) / best_seconds(evaluate, repeats=2)
    many = geometries()
    compiled = COUNT / best_seconds(lambda: MODEL.brdf(*many))
    print(f"\npySCATMECH {other / 1e6:.3f} million/s; ratio {compiled / other:.0f}")


@pytest.mark.parametrize("cache", ["cold", "warm"])
def test_first_call_after_import(cache, tmp_path):
    code = (
        "import time; from pbrdf import Material, MicrofacetModel; t = time.perf_counter();"
        "MicrofacetModel(Material(1.5), 0.3).brdf(0.5, 0.6, 3.0);"
        "print(time.perf_counter() - t)"
    )
    environment = os.environ | {"PBRDF_CACHE_DIR": str(tmp_path)}

    def seconds():
        run = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, check=True
        )
        return float(run.stdout)

    first = seconds()
    print(f"\nfirst call, {cache} cache: {first if cache == 'cold' else seconds():.2f} s")
