"""`gvpipe reproduce`: the claims of papers, measured, as a table, JSON and Markdown."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gvpipe.benchmark.json_results import write_results
from gvpipe.benchmark.report import BenchReport
from gvpipe.benchmark.reproduction import laplacian_claims, mcgv_claims, pca_claims, pdct_claims
from gvpipe.benchmark.reproduction.claims import Claim, Outcome, judge
from gvpipe.benchmark.reproduction.lab import QUALITIES, QUICK_QUALITIES, Lab
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress

PAPERS = {
    "mcgv": ("Mamou, Zaharia and Preteux, Multi-Chart Geometry Video, 2007", mcgv_claims.claims),
    "pca": ("Vasa and Skala, Geometry-Driven Local Neighbourhood Based Predictors, 2010", pca_claims.claims),
    "laplacian": (
        "Vasa, Marras, Hormann and Brunnett, Compressing dynamic meshes with geometric Laplacians, 2014",
        laplacian_claims.claims,
    ),
    "pdct": ("Amjoun and Strasser, Predictive-DCT Coding for 3D Mesh Sequences Compression, 2008", pdct_claims.claims),
}
LARGE = ("samba",)  # what a quick run leaves out
CURVES = "curves.json"


@dataclass(frozen=True)
class Reproduction:
    """Outcomes by paper, and the curves that they rest on."""

    outcomes: dict[str, list[Outcome]]
    curves: BenchReport

    def to_json(self) -> dict[str, Any]:
        """The outcomes as JSON values, with version, machine and command."""
        papers = {name: [outcome.to_json() for outcome in outcomes] for name, outcomes in self.outcomes.items()}
        return {"gvpipe": self.curves.gvpipe, "machine": self.curves.machine, "command": self.curves.command, "papers": papers}

    def markdown(self) -> str:
        """A heading and a table for each paper."""
        papers = self.to_json()["papers"]
        return "\n\n".join(f"## {name}\n\n{PAPERS[name][0]}.\n\n{table(made)}" for name, made in papers.items()) + "\n"

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write ``reproduction.json``, ``reproduction.md`` and the curves into a folder; raises `OutputError`."""
        write_results(Path(folder) / "reproduction.json", self.to_json())
        self.curves.write(Path(folder) / CURVES)
        with unnamed_path(Path(folder) / "reproduction.md") as temporary:
            temporary.write_text(self.markdown(), "utf-8")


def reproduce(
    papers: Sequence[str],
    data: str | os.PathLike[str],
    quick: bool = False,
    out: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Reproduction:
    """Measure the claims of papers.

    Args:
        papers: names in `PAPERS`.
        data: folder of sequences, ``NAME.npz``.
        quick: three qualities in place of six, and without the largest sequence.
        out: folder for results. Curves are kept there as they are measured; a later run measures those that are missing.
        progress: called before each curve.

    Raises:
        InputError: there is no such paper or folder; a sequence cannot be used.
    """
    wrong = next((name for name in papers if name not in PAPERS), None)
    if wrong is not None:
        raise InputError(f"no paper {wrong!r}; there are {', '.join(PAPERS)}")
    if not Path(data).is_dir():
        raise InputError(f"{data} is no folder; give the one with the sequences as --data DIR")
    if out is not None:
        Path(out).mkdir(parents=True, exist_ok=True)
    lab = Lab(
        Path(data),
        QUICK_QUALITIES if quick else QUALITIES,
        _known(out),
        LARGE if quick else (),
        progress,
        None if out is None else (lambda report: report.write(Path(out) / CURVES)),
    )
    outcomes: dict[str, list[Outcome]] = {}
    for name in papers:
        outcomes[name] = [judge(claim, lab) for claim in claims_of(name)]
        if out is not None:
            Reproduction(outcomes, lab.report()).write(out)
    return Reproduction(outcomes, lab.report())


def claims_of(paper: str) -> list[Claim]:
    """The claims of a paper, in its order."""
    return PAPERS[paper][1]()


def table(outcomes: Sequence[Mapping[str, Any]]) -> str:
    """A table in Markdown of `Outcome.to_json`: claims, numbers, ratio, state and why."""
    rows = ["| where | the paper says | paper | ours | ours / paper | state | remark |", "|---|---|---|---|---|---|---|"]
    for one in outcomes:
        rule = "" if one["ours"] is None else f"{one['rule']} "
        paper = "-" if one["paper"] is None else f"{rule}{one['paper']:g} {one['unit']}".strip()
        ours = "-" if one["ours"] is None else f"{one['ours']:.4g} {one['unit']}".strip()
        ratio = "-" if one["ratio"] is None else f"{one['ratio']:.2f}"
        rows.append(f"| {' | '.join((one['where'], one['claim'], paper, ours, ratio, one['state'], one['why'] or '-'))} |")
    return "\n".join(rows)


def _known(out: str | os.PathLike[str] | None) -> list[Any]:
    path = None if out is None else Path(out) / CURVES
    return BenchReport.read(path).curves if path is not None and path.is_file() else []
