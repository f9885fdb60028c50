"""The constants that the web player shares with Python: python tools/web_constants.py writes gvpipe/web/src/constants.js.

A constant has the name of its module and its own: ``REACH`` of `gvpipe.connectivity.vertex_order` is ``VERTEX_ORDER_REACH``.
The names of codecs without pictures come before.
`tests/web/test_export.py` compares the file with what this script makes.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any
from uuid import UUID

PREFIXED = ("GVCODECS.LAPLACIAN", "GVCODECS.PCA", "GVCODECS.PDCT")
TARGET = Path(__file__).parents[1] / "gvpipe" / "web" / "src" / "constants.js"
SHARED = {
    "gvpipe.asset_coding.directory": "SECTION VERSION MOST MAX_BYTES SURFACE OCTAHEDRAL REDUCED",
    "gvpipe.asset_coding.encoder": "ARRANGEMENT CODED",
    "gvpipe.asset_coding.times": "SECTION",
    "gvpipe.asset_coding.volume_list": "SECTION CELLS ORDER POINTS VERSION IN_ORDER BY_WALK BY_CORNERS "
    "MAX_BYTES MOST_CELLS MOST_POINTS",
    "gvpipe.asset_coding.volume_reader": "BYTES_PER_CELL SECONDS_PER_CELL BYTES_PER_POINT SECONDS_PER_POINT",
    "gvpipe.attributes.linear_kernels": "AFFINE PARALLELOGRAM",
    "gvpipe.attributes.match_kernels": "N_MATCH_CONTEXTS N_RESIDUAL_CONTEXTS",
    "gvpipe.attributes.octahedral_kernels": "MEAN PLACE PLACE_CORRECTED SURFACE",
    "gvpipe.attributes.part_kernels": "N_PART_CONTEXTS",
    "gvpipe.attributes.polygon_kernels": "N_CONTEXTS",
    "gvpipe.attributes.sharing_kernels": "N_CONTEXTS",
    "gvpipe.attributes.value_coding": "MAX_SHIFT",
    "gvpipe.connectivity.adaptive_mesh": "MAX_POINTS",
    "gvpipe.connectivity.adaptive_order": "MAX_VERTICES",
    "gvpipe.connectivity.candidate_kernels": "N_CONTEXTS N_GROUPS NUMBER_CONTEXTS NUMBER_GROUPS",
    "gvpipe.connectivity.candidate_order": "MARK MAX_VERTICES",
    "gvpipe.connectivity.base_mesh": "DRACO_PREFIX MAX_PER_BYTE",
    "gvpipe.connectivity.cell_kernels": "N_CONTEXTS",
    "gvpipe.connectivity.cell_middles": "MIDDLES",
    "gvpipe.connectivity.cell_traversal": "KEEPS RANKED",
    "gvpipe.connectivity.cell_poses": "KINDS MOST_POSES MOST_NODES MOST_FACES",
    "gvpipe.connectivity.edge_seam_kernels": "CONTEXTS DECODE",
    "gvpipe.connectivity.fitted_kernels": "N_CONTEXTS N_GROUPS",
    "gvpipe.connectivity.order_kernels": "N_CONTEXTS N_GROUPS",
    "gvpipe.connectivity.position_kernels": "N_CONTEXTS N_GROUPS",
    "gvpipe.connectivity.vertex_order": "REACH MAX_VERTICES",
    "gvpipe.connectivity.visit_symbols": "N_SYMBOLS",
    "gvpipe.connectivity.welded_mesh": "ADAPTIVE_MESH ADAPTIVE_ORDER FITTED_MESH",
    "gvpipe.container.bare": "MAGIC DICTIONARY WITH_SHARED",
    "gvpipe.container.bitstream": "MAGIC VERSION MAX_SECTIONS MAX_NAME MAX_HEADER MAX_FRAMES MAX_VERTICES",
    "gvpipe.container.compact_header": "MAX_LENGTH",
    "gvpipe.container.mp4": "BOX_UUID MAX_BOXES",
    "gvpipe.container.plain": "VERSION MOST_VERSIONS DICTIONARY",
    "gvpipe.container.segments": "TINY HUGE SMALLEST_STEP LARGEST_STEP MAX_SEGMENT",
    "gvpipe.container.live_layout": "HEAD_BYTES LIVE_UUID",
    "gvpipe.container.shared_sections": "MAX_SHARED",
    "gvpipe.container.shot_layout": "MAGIC MAX_SHOTS MAX_HEADER MAX_BYTES MAX_POSTER FARTHEST",
    "gvpipe.container.stream_layout": "INDEX_UUID ROOM_UUID SHOTS_UUID DATA_UUID MAX_INDEX",
    "gvpipe.coding.corrections.displacements": "MAX_POSITIONS NEAR",
    "gvpipe.entropy.block_coder": "PARAMETRIC",
    "gvpipe.entropy.decision_kernels": "ONE_BITS SEEN_BITS AHEAD PLACE RANGE",
    "gvpipe.entropy.forecast_kernels": "N_FORECASTS",
    "gvpipe.entropy.integers": "MAX_CONTEXTS",
    "gvpipe.entropy.logistic_tables": "LIMIT SPACING KNOTS",
    "gvpipe.entropy.number_kernels": "SLOT_BITS MIXERS",
    "gvpipe.entropy.parametric_tables": "N_TOKENS RATIO_BITS RATIOS TOTAL ZEROS",
    "gvpipe.entropy.range_decoder": "PRECISION",
    "gvpipe.entropy.series": "MAX_CLASS FIRST_CLASS",
    "gvpipe.entropy.tokens": "DIRECT TABLE_TOTAL MAX_TOKENS",
    "gvpipe.foundation.errors": "REMEDY",
    "gvpipe.fields.derived": "MAGNITUDE SIGNALS",
    "gvpipe.fields.graph": "MOST_RING MOST_BEYOND MOST_WAVES RING_VARIANCE FAR_VARIANCE SURE LEAST",
    "gvpipe.fields.head": "MAX_VALUES VERSION",
    "gvpipe.fields.prediction": "TUNINGS",
    "gvpipe.fields.prediction_kernels": "STEPS WHOLE FLOATS N_FILTERS N_SHARED",
    "gvpipe.fields.residual_kernels": "N_CONTEXTS N_FINE N_COARSE NODES N_MIXERS",
    "gvpipe.fields.segment": "EXACT TRAJECTORIES DERIVED TUNED",
    "gvpipe.fields.values": "MAX_COMPONENTS",
    "gvpipe.grids.cells": "VOLUMES SIZES",
    "gvpipe.media.video": "MAX_SIDE PROFILES",
    "gvpipe.mesh.hierarchy": "MAX_WAVES PEAK_PER_VERTEX PEAK_PER_TRIANGLE KEPT_PER_VERTEX KEPT_PER_TRIANGLE SECONDS_PER_VERTEX "
    "SECONDS_PER_TRIANGLE",
    "gvpipe.model.warp": "USUAL",
    "gvpipe.rasterizer.colormaps": "MAGMA VIRIDIS",
    "gvpipe.coding.repeated_frames": "SECTION",
    "gvpipe.trajectory.basis": "MAX_COMPONENTS MAX_SCALE PER_OCTAVE LEAST_OUTSIDE BYTES_PER_VALUE SECONDS_PER_VALUE "
    "BYTES_PER_ROW",
    "gvpipe.trajectory.coefficient_coding": "MAX_VALUES MOST_FLAGS",
    "gvpipe.trajectory.contexts": "PER_OCTAVE MAX_LEVEL N_CONTEXTS TREND_POWERS",
    "gvpipe.trajectory.prediction": "PREDICTORS",
    "gvpipe.trajectory.still_points": "SECTION BYTES_PER_STILL SECONDS_PER_STILL SECONDS_PER_PRODUCT",
    "gvpipe.trajectory.temporal_neighbours": "MAX_NEIGHBOURS MORE_NEIGHBOURS VARIANCE MORE_VARIANCE MIN_BLOCK "
    "CUBIC LINEAR OFFSETS",
    "gvpipe.trajectory.spatial_neighbours": "PEAK_PER_VERTEX PEAK_PER_TRIANGLE SECONDS_PER_VERTEX SECONDS_PER_TRIANGLE",
    "gvpipe.trajectory.trellis": "FINENESS PARTS ZEROS SHAPES TREND_ZEROS TREND_SHAPES GRADES FINDS_NOISES WHAT FALL "
    "LEAST_GRADE",
    "gvcodecs.laplacian.average_coding": "NAME SPACING FARTHEST",
    "gvcodecs.laplacian.anchors": "ANCHOR_CHOICES",
    "gvcodecs.laplacian.delta_rows": "DELTA_PREDICTIONS N_CAUSAL N_RING",
    "gvcodecs.laplacian.header": "MAX_SEGMENTS VERSION MAX_SPACING LEAST_RATIO MOST_RATIO FINEST COARSEST MOST_POWER",
    "gvcodecs.laplacian.laplace_operators": "OPERATORS",
    "gvcodecs.laplacian.normal_equations": "COLUMNS FREE_PRODUCTS PRODUCTS BYTES_PER_PAIR SECONDS_PER_PAIR BYTES_PER_ENTRY "
    "SECONDS_PER_ENTRY SECONDS_PER_PRODUCT SECONDS_PER_STEP SECONDS_PER_SOLVED",
    "gvcodecs.mcgv.base.surface": "STILL",
    "gvcodecs.mcgv.header": "VERSION OF_PICTURES MAX_FINENESS PREDICTIONS PLACEMENTS MAX_CLUSTERS MAX_SEGMENTS",
    "gvcodecs.mcgv.layout.chart_coding": "CONTEXTS",
    "gvcodecs.mcgv.layout.chart_kernels": "MAX_NEAR",
    "gvcodecs.mcgv.layout.coding": "CONTEXTS",
    "gvcodecs.mcgv.layout.directions": "COMMON",
    "gvcodecs.mcgv.layout.kd_tree": "FRAME MOMENT_BITS SPREAD MAX_COORDINATE",
    "gvcodecs.mcgv.motion.blend_kernels": "FLAT LEAST_ENERGY",
    "gvcodecs.mcgv.motion.row_neighbours": "MOST VARIANCE",
    "gvcodecs.mcgv.motion.skinning": "INFLUENCES TOTAL",
    "gvcodecs.mcgv.motion.skinning_coding": "PREDICTED",
    "gvcodecs.mcgv.motion.weight_coding": "COUNT_CONTEXTS",
    "gvcodecs.mcgv.motion.weight_kernels": "MAX_LISTED",
    "gvcodecs.mcgv.pictures.trajectories": "PLANES",
    "gvcodecs.mcgv.decoding.trajectory_reader": "BYTES_PER_SAMPLE SECONDS_PER_SAMPLE",
    "gvcodecs.pca.coefficients": "MOST_FIRST FIRST_STEP",
    "gvcodecs.pca.header": "MAX_SEGMENTS VERSION",
    "gvcodecs.pdct.clip": "MAX_CLUSTERS BYTES_PER_POINT SECONDS_PER_POINT BYTES_PER_NUMBER SECONDS_PER_FRAME",
    "gvcodecs.pdct.delta_coding": "PROBLEMS",
    "gvcodecs.pdct.header": "MAX_CLIPS VERSION",
    "gvcodecs.pdct.reader": "BYTES_PER_POINT SECONDS_PER_POINT",
    "gvcodecs.pdct.seed_coding": "ORDERS MAX_COORDINATE",
    "gvcodecs.pdct.still_points": "SECTION",
}


def make() -> str:
    """Return the JavaScript file."""
    lines = ["// Made by tools/web_constants.py from gvpipe's Python modules; edit those, and run it again."]
    for module, names in SHARED.items():
        loaded = import_module(module)
        package, _, prefix = module.upper().rpartition(".")
        if package in PREFIXED:
            prefix = f"{package.rpartition('.')[2]}_{prefix}"
        lines += ["", f"// {module}"]
        lines += [f"export const {prefix}_{name} = {_literal(getattr(loaded, name))};" for name in names.split()]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the file."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    TARGET.write_text(make(), "utf-8")


def _literal(value: Any) -> str:
    """A value as JavaScript writes it."""
    if isinstance(value, UUID):
        value = value.bytes
    if isinstance(value, bytes):
        value = list(value)
    if isinstance(value, dict):
        return f"new Map({json.dumps(list(value.items()), default=asdict)})"
    return json.dumps(value, allow_nan=False)


if __name__ == "__main__":
    main()
