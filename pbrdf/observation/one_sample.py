"""What a detector sees of one surface sample, for every geometry of a scan."""

import numpy as np

from pbrdf.kernels.cones.paths import COUNT, FAR_END, SHARE
from pbrdf.observation.bundles import send_bundles
from pbrdf.observation.expected import Expected
from pbrdf.observation.facets import ask_facets
from pbrdf.observation.look import Look, Sight, Sums
from pbrdf.tracer.field import Field
from pbrdf.tracer.mesh_field import MeshField


def look_at(
    surface: Field | MeshField,
    look: Look,
    seed: np.random.SeedSequence,
    expected: Expected | None = None,
) -> Sight:
    """Look at one surface from every detector; releases the interpreter lock."""
    sample = Sums(look)
    rng = np.random.default_rng(seed)
    of_facets = look.estimator in ("facets", "paths")
    if of_facets:
        ask_facets(surface, sample, rng, expected)
    counting = look.estimator == "count"
    # Only a path of two bounces and more needs bundles once the facets were asked
    if look.max_bounces > 1 or look.base.shape[1] > 0 or not of_facets:
        kind = COUNT if counting else SHARE
        send_bundles(
            surface, sample, rng, kind, 2 if of_facets else 1, from_source=look.from_source
        )
    if look.base.shape[1] > 0 and not counting:
        send_bundles(surface, sample, rng, FAR_END, 1, from_source=not look.from_source)
    unknown = np.full_like(sample.energy, np.nan)
    return Sight(
        brdf=sample.brdf,
        caught=sample.caught,
        tried=sample.tried,
        glints=sample.glints,
        glints_caught=sample.glints_caught,
        foretold=sample.foretold,
        one=sample.one,
        energy=sample.energy / sample.valued if sample.valued > 0 else unknown,
        counts=sample.counts,
        facet_counts=sample.facet_counts,
        bundles=sample.bundles,
    )
