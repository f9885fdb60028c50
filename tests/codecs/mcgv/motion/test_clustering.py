"""K-means of motions: what it ignores is ignored nowhere else."""

from __future__ import annotations

import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from gvcodecs.mcgv.motion.point_motions import Clustering


def test_threads_leave_the_warnings_of_the_process_alone() -> None:
    """Charts start from clusters beside the blend."""
    clustering, filters = Clustering(np.random.default_rng(1).normal(size=(300, 4))), list(warnings.filters)
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(clustering.start, [5] * 100))
    assert warnings.filters == filters
    assert all(np.array_equal(each.weights.clusters, found[0].weights.clusters) for each in found)
