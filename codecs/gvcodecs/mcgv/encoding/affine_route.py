"""Affine prediction as published: partition, charts, transforms, and the residuals of frames as pictures.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007. The target error touches neither layout nor transforms.
"""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.coded_route import Coded
from gvcodecs.mcgv.encoding.placement import lay_out
from gvcodecs.mcgv.layout.coding import encode_clusters, encode_slot_clusters
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.motion.affine import code_affine
from gvcodecs.mcgv.motion.contract import CodedMotion
from gvcodecs.mcgv.motion.segmentation import segment
from gvcodecs.mcgv.pictures.frames import code_frames, measure_residuals

CLUSTERS = 20  # the paper's


def code_published(job: Job, start: Start) -> Coded:
    """Code what a start holds as published."""
    motion, layout = job.memo("motion", lambda: _predict(job, start))
    magnitudes = job.memo("magnitudes", lambda: measure_residuals(start, motion))
    return Coded.of_frames(layout, motion, code_frames(job, start, motion, layout, magnitudes), {})


def _predict(job: Job, start: Start) -> tuple[CodedMotion, Layout]:
    """The paper's partition, layout and transforms."""
    step = _extent(job, start) / 2**job.settings.transform_bits
    job.report("segment", 0)
    clusters = segment(start.sequence, start.base, start.points.neighbours, job.settings.clusters or CLUSTERS)
    quiet = dataclasses.replace(job, report=lambda stage, done: None)  # one thread alone reports
    if start.placement == "charts":
        job.report("parameterize", 0)
    with ThreadPoolExecutor(1) as pool:  # xatlas, in a process of its own, beside the transforms
        placed = pool.submit(lay_out, quiet, start, clusters, clusters)
        motion = code_affine(start, clusters, step, job.report)
        layout = placed.result()
    if start.placement == "halves":
        section = encode_slot_clusters(clusters)
    else:
        section = encode_clusters(clusters, layout, job.settings.block)
    return dataclasses.replace(motion, sections={**motion.sections, "clusters": section}), layout


def _extent(job: Job, start: Start) -> float:
    """The longest side of the bounding box of all frames, model units; 1 if all is one point."""
    sequence = start.sequence
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for first, block in sequence.chunks():
        low, high = np.minimum(low, block.min(axis=(0, 1))), np.maximum(high, block.max(axis=(0, 1)))
        job.report("read", (first + len(block)) / sequence.n_frames)
    return float((high - low).max()) or 1.0
