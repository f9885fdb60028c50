"""The constants that the web player shares with Python: python tools/web_constants.py writes gvpipe/web/src/constants.js.

A constant has the name of its module and its own: ``REACH`` of `gvpipe.connectivity.vertex_order` is ``VERTEX_ORDER_REACH``.
`tests/web/test_export.py` compares the file with what this script makes.
"""

from __future__ import annotations

import argparse
import json
from importlib import import_module
from pathlib import Path
from typing import Any
from uuid import UUID

TARGET = Path(__file__).parents[1] / "gvpipe" / "web" / "src" / "constants.js"
SHARED = {
    "gvpipe.asset_coding.directory": "SECTION VERSION MOST MAX_BYTES SURFACE OCTAHEDRAL",
    "gvpipe.asset_coding.encoder": "ARRANGEMENT CODED",
    "gvpipe.connectivity.adaptive_mesh": "MAX_POINTS",
    "gvpipe.connectivity.adaptive_order": "MAX_VERTICES",
    "gvpipe.connectivity.base_mesh": "DRACO_PREFIX MAX_PER_BYTE",
    "gvpipe.connectivity.edge_seam_kernels": "LOOK SAME SINGLE LATER NEW",
    "gvpipe.connectivity.order_kernels": "N_CONTEXTS N_GROUPS LOOKED_AT MATCHED MATCH_BITS MAX_RUN LONG_RUN",
    "gvpipe.connectivity.position_kernels": "N_CONTEXTS N_GROUPS MATCHED MATCH_BITS MAX_RUN LONG_RUN",
    "gvpipe.connectivity.seams": "MAX_SEAM_VERTICES",
    "gvpipe.connectivity.vertex_order": "REACH EXACT_RANKS ESCAPE N_SYMBOLS MAX_VERTICES",
    "gvpipe.connectivity.welded_mesh": "ADAPTIVE_MESH ADAPTIVE_ORDER",
    "gvpipe.container.bitstream": "MAGIC VERSION MAX_SECTIONS MAX_NAME MAX_HEADER MAX_FRAMES MAX_VERTICES",
    "gvpipe.container.mp4": "BOX_UUID MAX_BOXES",
    "gvpipe.container.segments": "TINY HUGE LARGEST_STEP MAX_SEGMENT",
    "gvpipe.container.stream_layout": "VERSION INDEX_UUID MAX_INDEX",
    "gvpipe.corrections.displacements": "MAX_POSITIONS NEAR",
    "gvpipe.entropy.block_coder": "PARAMETRIC",
    "gvpipe.entropy.decision_kernels": "ONE_BITS AHEAD RATE RATE_BITS PLACE RANGE",
    "gvpipe.entropy.integers": "MAX_CONTEXTS",
    "gvpipe.entropy.logistic_tables": "LIMIT SPACING KNOTS",
    "gvpipe.entropy.number_kernels": "MAX_LENGTH MODELLED SLOT_BITS SIGN NODES FACTOR MIXERS",
    "gvpipe.entropy.parametric_tables": "N_TOKENS RATIO_BITS RATIOS TOTAL ZEROS",
    "gvpipe.entropy.range_decoder": "PRECISION",
    "gvpipe.entropy.series": "MAX_CLASS",
    "gvpipe.entropy.tokens": "DIRECT TABLE_TOTAL MAX_TOKENS CHUNK",
    "gvpipe.errors": "REMEDY",
    "gvpipe.fields.derived": "MAGNITUDE SIGNALS",
    "gvpipe.fields.head": "MAX_VALUES VERSION",
    "gvpipe.fields.prediction_kernels": "STEPS WHOLE FLOATS N_FILTERS N_SHARED",
    "gvpipe.fields.residual_kernels": "N_CONTEXTS N_FINE N_COARSE NODES N_MIXERS",
    "gvpipe.fields.segment": "EXACT TRAJECTORIES DERIVED",
    "gvpipe.fields.values": "MAX_COMPONENTS",
    "gvpipe.media.video": "MAX_SIDE",
    "gvpipe.mesh.hierarchy": "MAX_WAVES",
    "gvpipe.rasterizer.colormaps": "MAGMA VIRIDIS",
    "gvpipe.repeated_frames": "SECTION",
    "gvpipe.trajectory.basis": "MAX_COMPONENTS MAX_SCALE PER_OCTAVE LEAST_OUTSIDE",
    "gvpipe.trajectory.coefficient_coding": "LARGEST MAX_VALUES",
    "gvpipe.trajectory.contexts": "SHORT LONG ONE PER_OCTAVE MAX_LEVEL FLOOR_SPAN FLOOR_NEAR POWERS POWER_ONE LOWEST HIGHEST "
    "N_CONTEXTS N_NEAR",
    "gvpipe.trajectory.prediction_kernels": "DOUBT",
    "gvpipe.trajectory.spatial_neighbours": "OVERSHOOT RING_VARIANCE FAR_VARIANCE SURE LEAST",
    "gvpipe.trajectory.temporal_neighbours": "MAX_NEIGHBOURS VARIANCE MIN_BLOCK CUBIC LINEAR OFFSETS",
    "gvcodecs.mcgv.base.surface": "STILL",
    "gvcodecs.mcgv.browser": "VERSION PROFILE",
    "gvcodecs.mcgv.header": "OF_PICTURES PREDICTIONS PLACEMENTS MAX_CLUSTERS MAX_SEGMENTS",
    "gvcodecs.mcgv.layout.chart_coding": "CONTEXTS",
    "gvcodecs.mcgv.layout.chart_kernels": "MAX_NEAR",
    "gvcodecs.mcgv.layout.coding": "CONTEXTS",
    "gvcodecs.mcgv.layout.kd_tree": "COMMON FRAME MOMENT_BITS SPREAD MAX_COORDINATE",
    "gvcodecs.mcgv.motion.skinning": "INFLUENCES TOTAL FLAT LEAST_ENERGY",
    "gvcodecs.mcgv.motion.weight_coding": "COUNT_CONTEXTS",
    "gvcodecs.mcgv.motion.weight_kernels": "MAX_NEIGHBOURS",
}


def make() -> str:
    """Return the JavaScript file."""
    lines = ["// Made by tools/web_constants.py from gvpipe's Python modules; edit those, and run it again."]
    for module, names in SHARED.items():
        loaded = import_module(module)
        prefix = module.rpartition(".")[2].upper()
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
        return f"new Map({json.dumps(list(value.items()))})"
    return json.dumps(value, allow_nan=False)


if __name__ == "__main__":
    main()
