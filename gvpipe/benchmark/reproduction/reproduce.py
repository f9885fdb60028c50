"""`gvpipe reproduce`: the claims of papers, measured, as a table, JSON and Markdown."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gvpipe.benchmark.json_results import NUMBER, checked, read_results, write_results
from gvpipe.benchmark.report import BenchReport, Curve
from gvpipe.benchmark.reproduction import baseline_claims, laplacian_claims, mcgv_claims, pca_claims, pdct_claims
from gvpipe.benchmark.reproduction.claims import Claim, Outcome, judge
from gvpipe.benchmark.reproduction.lab import QUALITIES, QUICK_QUALITIES, Lab
from gvpipe.coding.registry import codec_ids
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
    "baselines": ("Figures that are published of the baselines themselves", baseline_claims.claims),
}
ALL = "all"  # for `again`: every codec
LARGE = ("samba",)  # what a quick run leaves out
CURVES, OUTCOMES = "curves.json", "reproduction.json"


@dataclass(frozen=True)
class Reproduction:
    """Outcomes by paper, the curves that they rest on, and what an earlier run left of other papers, as JSON values."""

    outcomes: dict[str, list[Outcome]]
    curves: BenchReport
    others: Mapping[str, list[dict[str, Any]]] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The outcomes as JSON values, with version, machine and command."""
        made = {name: [outcome.to_json() for outcome in outcomes] for name, outcomes in self.outcomes.items()}
        found = {**self.others, **made}
        papers = {name: found[name] for name in PAPERS if name in found}
        return {"gvpipe": self.curves.gvpipe, "machine": self.curves.machine, "command": self.curves.command, "papers": papers}

    def markdown(self) -> str:
        """A heading and a table for each paper."""
        papers = self.to_json()["papers"]
        return "\n\n".join(f"## {name}\n\n{PAPERS[name][0]}.\n\n{table(made)}" for name, made in papers.items()) + "\n"

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write ``reproduction.json``, ``reproduction.md`` and the curves into a folder; raises `OutputError`."""
        write_results(Path(folder) / OUTCOMES, self.to_json())
        self.curves.write(Path(folder) / CURVES)
        with unnamed_path(Path(folder) / "reproduction.md") as temporary:
            temporary.write_text(self.markdown(), "utf-8")


def reproduce(
    papers: Sequence[str],
    data: str | os.PathLike[str],
    quick: bool = False,
    out: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    again: Sequence[str] = (),
) -> Reproduction:
    """Measure the claims of papers.

    Args:
        papers: names in `PAPERS`; others that ``out`` has stay there.
        data: folder of sequences, ``NAME.npz``.
        quick: three qualities in place of six, and without the largest sequence.
        out: folder for results. Curves and outcomes are kept there as they are found; a later run measures what is missing.
        progress: called before each curve.
        again: ids of codecs whose curves in ``out`` are forgotten, or `ALL`. A run without it goes on with an interrupted one.

    Raises:
        InputError: there is no such paper, codec or folder; a sequence cannot be used.
    """
    wrong = next((name for name in papers if name not in PAPERS), None)
    if wrong is not None:
        raise InputError(f"no paper {wrong!r}; there are {', '.join(PAPERS)}")
    unknown = next((name for name in again if name != ALL and name not in codec_ids()), None)
    if unknown is not None:
        raise InputError(f"no codec {unknown!r} to measure again; there are {ALL}, {', '.join(codec_ids())}")
    if not Path(data).is_dir():
        raise InputError(f"{data} is no folder; give the one with the sequences as --data DIR")
    if out is not None:
        Path(out).mkdir(parents=True, exist_ok=True)
    known = [curve for curve in _known_curves(out) if not {ALL, curve.codec.split(":")[0]} & set(again)]
    lab = Lab(
        Path(data),
        QUICK_QUALITIES if quick else QUALITIES,
        known,
        LARGE if quick else (),
        progress,
        None if out is None else (lambda report: report.write(Path(out) / CURVES)),
    )
    if out is not None and again:
        lab.report().write(Path(out) / CURVES)
    outcomes: dict[str, list[Outcome]] = {}
    others = {name: made for name, made in _known_outcomes(out).items() if name not in papers}
    for name in papers:
        outcomes[name] = []
        for claim in claims_of(name):
            outcomes[name].append(judge(claim, lab))
            if out is not None:
                Reproduction(outcomes, lab.report(), others).write(out)
    return Reproduction(outcomes, lab.report(), others)


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


def _known_curves(out: str | os.PathLike[str] | None) -> list[Curve]:
    path = None if out is None else Path(out) / CURVES
    return BenchReport.read(path).curves if path is not None and path.is_file() else []


def _known_outcomes(out: str | os.PathLike[str] | None) -> dict[str, list[dict[str, Any]]]:
    """What `Reproduction.write` left in a folder, by paper; raises `InputError` if it is something else."""
    path = None if out is None else Path(out) / OUTCOMES
    if path is None or not path.is_file():
        return {}
    keys = dict.fromkeys(("id", "where", "claim", "unit", "rule", "state", "why"), str)

    def parse(given: Any) -> dict[str, list[dict[str, Any]]]:
        papers = checked(checked(given, {"papers": dict}, "the file")["papers"], {}, "papers")
        for name, made in papers.items():
            for one in made if isinstance(made, list) else [made]:
                checked(one, {**keys, "paper": NUMBER, "ours": NUMBER, "ratio": NUMBER}, f"a claim of {name}")
        return papers

    return read_results(path, parse)
