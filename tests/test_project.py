"""What the project says of itself holds: version, paths, links, names of modules, settings of the workflow."""

from __future__ import annotations

import re
import runpy
import tomllib
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from folders import ROOT

import gvpipe

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
NAMELESS = ("CHANGELOG.md", "tests/test_project.py")  # may name modules that are gone
OLD_MODULES = {  # of the flat layout
    "gvpipe": """
        aiming auto bare_mesh bench binary bitstream block_kernels blocks breakdown coarse_walk console copies curves
        decimation fans frame_rows hierarchy holds images index_rows magnitude_tables matching mesh_rows moves pipes plots
        point_mesh poster prediction_kernels purposes quality quantize range_kernels rate row_coding row_kernels
        row_prediction segments sted stillness still_points surface topology trajectories trajectory_basis trajectory_frames
        trials vertex_errors vertex_order video welding rendering.camera rendering.colours rendering.renderer
        rendering.raster_kernels rendering.shading_kernels rendering.pictures
        ahead arguments arrays atomic blas borrowing budget coarse_asset compiled corrections files forks frame_cache
        frame_views isolation lanes live machine_code notes origin part_choice player quality_scale registry
        repeated_frames segment_map segment_memory sequence shared_parts shared_reader source_info text version video_info
        warmup
    """,
    "gvpipe.io": """
        concatenate described discovery export frame_columns frame_files frame_normals hiding library_process library_worker
        mapped_pages mtl mtl_writer npz_asset npz_fields npz_odd numbering obj_changes obj_lines obj_parts obj_writer
        off_writer own_normals pattern ply_elements ply_kernels ply_writer pvd_writer scene_export scene_fields scene_frames
        scene_layers scene_mesh scene_normals scene_process scene_worker spool step_lists turned_normals vtkhdf_writer
        writing_process writing_worker
    """,
    "gvcodecs.mcgv": """affine_motion blend_fitting blend_kernels blended_motion blending chart_coding chart_kernels
        chart_placement format frame_images outliers packing padding parameterization placement points prediction quality
        rebuilding segmentation separation surface trajectories trajectory_encoder trajectory_images transforms weight_choice
        weight_coding weight_kernels browser reader_choice trajectory_reader""",
    "gvcodecs.laplacian": "format kernels system",
    "gvcodecs.pca": "format",
    "gvcodecs.pdct": "format stillness",
}


def test_one_version() -> None:
    """``gvpipe.__version__`` is the source; the citation repeats it."""
    assert "version" in PROJECT["dynamic"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.MULTILINE) == [gvpipe.__version__] == [version("gvpipe")]


def test_docstrings_name_their_subject() -> None:
    """Who reads "Of a plane." over a function must look for what of it is meant."""
    starts = re.compile(r'"""Of ')
    for source in ("gvpipe", "codecs/gvcodecs"):
        for path in (ROOT / source).rglob("*.py"):
            if "node_modules" not in path.parts:
                assert not starts.search(path.read_text(encoding="utf-8")), path


def test_messages_that_are_explained_are_those_that_are_raised() -> None:
    page = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
    rows = [line.split(" | ")[0] for line in page.splitlines() if line.startswith("| `")]
    shown = [text for row in rows for text in re.findall(r"`([^`]+)`", row)]
    sources = [*(ROOT / "gvpipe").rglob("*.py"), *(ROOT / "gvpipe/web/src").rglob("*.js")]
    texts = "\n".join(path.read_text(encoding="utf-8") for path in sources if "node_modules" not in path.parts)
    assert len(shown) > 20 and [text for text in shown if text not in texts] == []


def test_the_public_interface_is_the_recorded_one() -> None:
    """tools/list_interface.py records it: a line that goes, or changes, breaks somebody's program."""
    tool: dict[str, Any] = runpy.run_path(str(ROOT / "tools" / "list_interface.py"), run_name="list_interface")
    assert tool["listed"]() == (ROOT / "tests" / "public_interface.txt").read_text(encoding="utf-8")


def test_scripts_name_tests_that_there_are() -> None:
    scripts = [*(ROOT / ".ci").iterdir(), *(ROOT / ".github" / "workflows").glob("*.yml")]
    named = {name for path in scripts for name in re.findall(r"\btests(?:/\w+)+(?:\.py)?", path.read_text(encoding="utf-8"))}
    assert named and [name for name in sorted(named) if not (ROOT / name).exists()] == []


def test_every_folder_of_modules_is_a_package() -> None:
    """Import contracts do not see others."""
    folders = {path.parent for source in ("gvpipe", "codecs/gvcodecs") for path in (ROOT / source).rglob("*.py")}
    folders = {folder for folder in folders if not {"node_modules", "__pycache__"} & set(folder.parts)}
    assert [folder for folder in sorted(folders) if not (folder / "__init__.py").is_file()] == []


def test_python_versions_are_those_that_the_workflow_tests() -> None:
    workflow = (ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8")
    (tested,) = re.findall(r"python: \[(.*)\]", workflow)
    classified = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    assert re.findall(r"3\.\d+", tested) == classified
    assert PROJECT["requires-python"] == f">={classified[0]}"


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "RELEASING.md", "SECURITY.md"])
def test_paths_exist(page: str) -> None:
    named = re.findall(r"`((?:gvpipe|codecs|tests|tools|docs|samples)/[\w./-]*)`", (ROOT / page).read_text(encoding="utf-8"))
    assert named
    placeholders = [path for path in named if "NAME" in path]
    assert not [path for path in named if not (ROOT / path).exists() and path not in placeholders]


def test_ten_ideas_are_each_in_a_file() -> None:
    table = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("| idea | file |")[1].split("\n\n")[0]
    assert len(re.findall(r"^\| [^|]+ \| `\S+\.py`[^|]* \|$", table, re.MULTILINE)) == 10


@pytest.mark.parametrize("page", PAGES, ids=[page.relative_to(ROOT).as_posix() for page in PAGES])
def test_links_lead_to_files(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_the_reference_page_has_the_public_interface() -> None:
    page = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"^::: (.*)$", page, re.MULTILINE))
    # `gvpipe.foundation.errors` shows all errors
    assert {f"gvpipe.{name}" for name in gvpipe.__all__ if name != "GvpipeError"} | {"gvpipe.errors"} <= shown


def test_every_decision_is_in_the_index() -> None:
    index = re.findall(r"\(decisions/([\w-]+\.md)\)", (ROOT / "docs/architecture.md").read_text(encoding="utf-8"))
    assert sorted(index) == sorted(path.name for path in ROOT.glob("docs/decisions/*.md"))


def test_no_old_module_names() -> None:
    names = [f"{package}.{name}" for package, names in OLD_MODULES.items() for name in names.split()]
    paths = [name.replace(".", "/") for name in names]
    assert not [path for path in paths if (ROOT / f"{path}.py").exists() or (ROOT / f"codecs/{path}.py").exists()]
    dotted = re.compile(rf"\b({'|'.join(map(re.escape, names))})(?![\w/])")
    slashed = re.compile(rf"\b({'|'.join(paths)})\.py\b")
    for path in _texts():
        text = path.read_text(encoding="utf-8")
        assert not [*dotted.findall(text), *slashed.findall(text)], path


def _texts() -> Iterator[Path]:
    """The project's own text files."""
    folders = (".ci", ".github", "codecs", "docs", "gvpipe", "samples", "tests", "tools")
    for path in [*ROOT.glob("*.*"), *(path for folder in folders for path in (ROOT / folder).rglob("*"))]:
        name = path.relative_to(ROOT).as_posix()
        generated = "node_modules" in name or "web/bundle" in name
        if path.suffix in (".py", ".md", ".toml", ".yml", ".js", ".mjs") and not generated and name not in NAMELESS:
            yield path
