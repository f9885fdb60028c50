"""Claims of papers: how they are judged, and that curves which are there are not measured again."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Finished
from sequences import waving

import gvpipe
from gvpipe.benchmark.report import BenchReport, Curve
from gvpipe.benchmark.reproduction.claims import (
    AT_LEAST,
    AT_MOST,
    FAILS,
    HOLDS,
    NOT_RUN,
    Claim,
    error_at,
    fewer_bytes,
    judge,
    less_error,
    less_rate,
    rate,
)
from gvpipe.benchmark.reproduction.hypothetical import hypothetical_points
from gvpipe.benchmark.reproduction.lab import QUICK_QUALITIES, Lab
from gvpipe.benchmark.reproduction.reproduce import PAPERS, claims_of, reproduce
from gvpipe.benchmark.sweep import report_of
from gvpipe.foundation.errors import InputError

Run = Callable[..., Finished]


def curve(codec: str, factor: float, sequence: str = "cow") -> Curve:
    """Rate is ``factor / error``."""
    points = [
        {
            "quality": quality,
            "bytes": round(1000 * factor / error),
            "bpvf": factor / error,
            "sections": {"coefficients.0": round(500 * factor / error)},
            "encode_s": 0.5,
            "decode_s": 0.25,
            "decode_fps": 8.0,
            "max_diag": error,
            **dict.fromkeys(("rmse", "rmse_diag", "kg", "sted", "da"), error),
        }
        for quality, error in zip(QUICK_QUALITIES, (1.0, 0.1, 0.01), strict=True)
    ]
    return Curve(sequence, 9, 8, 2, codec, {}, None, points)


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    for name in ("cow", "chicken"):
        gvpipe.write(waving(3, 2), tmp_path / f"{name}.npz")
    return Lab(tmp_path, QUICK_QUALITIES, [curve("pca", 1.0), curve("pca:predictor=navg", 2.0)])


def test_rates_and_errors_of_curves(lab: Lab) -> None:
    assert rate("cow", "pca", "kg", 0.05)(lab) == pytest.approx(20)
    assert rate("cow", "pca", "kg", 2.0)(lab) is None
    assert error_at(curve("pca", 1.0).points, "kg", 20.0) == pytest.approx(0.05)
    assert error_at(curve("pca", 1.0).points, "kg", 2000.0) is None
    for measured, at in ((less_rate, 0.1), (less_error, 20.0)):
        assert measured("cow", "pca", "pca:predictor=navg", "kg", at)(lab) == pytest.approx(50)
    assert fewer_bytes("cow", "pca", "pca:predictor=navg", "coefficients")(lab) == pytest.approx(50)


def test_claims_are_judged(lab: Lab) -> None:
    measured = rate("cow", "pca", "kg", 0.05)

    def state(paper: float, rule: str) -> str:
        return judge(Claim("x", "Table 1", "", paper, "bpvf", rule, measured), lab).state

    assert [state(21, AT_MOST), state(19, AT_MOST), state(21, AT_LEAST)] == [HOLDS, FAILS, FAILS]
    assert [state(18, "about"), state(17, "about")] == [HOLDS, FAILS]
    for name, codec, why in (("dance", "pca", "dance.npz"), ("cow", "cobra", "cobra is not installed")):
        outcome = judge(Claim("x", "Table 1", "", 1, "", measure=rate(name, codec, "kg", 0.1)), lab)
        assert (outcome.state, outcome.ours) == (NOT_RUN, None) and why in outcome.why
    left_out = Lab(lab.data, QUICK_QUALITIES, lab.curves, skipped=["cow"])
    assert "quick" in judge(Claim("x", "Table 1", "", 1, "", measure=measured), left_out).why


@pytest.mark.parametrize("paper", PAPERS)
def test_every_claim_has_a_number_or_a_reason(paper: str) -> None:
    claims = claims_of(paper)
    assert len({claim.id for claim in claims}) == len(claims) > 10
    for claim in claims:
        assert claim.id.startswith(paper) and claim.text and claim.where
        assert claim.note if claim.measure is None else claim.paper is not None, claim.id


def test_results_rest_on_curves_that_are_there(lab: Lab, tmp_path: Path) -> None:
    codecs = [f"laplacian:operator={o}:delta_prediction={d}" for o, d in LAPLACIANS]
    (tmp_path / "out").mkdir()
    report_of([curve(codec, 1.0 + i) for i, codec in enumerate(codecs)]).write(tmp_path / "out" / "curves.json")
    made = reproduce(["laplacian"], tmp_path, quick=True, out=tmp_path / "out")
    states = {outcome.claim.id: outcome.state for outcome in made.outcomes["laplacian"]}
    assert states["laplacian-t1-cow-0.05-tutte"] == FAILS  # 1 / 0.05, above the paper's rate
    assert states["laplacian-t1-samba-0.02-tutte"] == NOT_RUN
    assert states["laplacian-t2-cow-tutte-encode"] == HOLDS
    written = json.loads((tmp_path / "out" / "reproduction.json").read_text())
    assert {one["id"]: one["state"] for one in written["papers"]["laplacian"]} == states
    assert (tmp_path / "out" / "reproduction.md").read_text().count("\n| ") == len(states) + 1


def test_a_later_run_keeps_what_it_does_not_measure(lab: Lab, tmp_path: Path) -> None:
    """Outcomes of other papers stay; --again forgets the curves of its codecs alone, and a run without it goes on."""
    data, out = tmp_path / "none", tmp_path / "out"
    for folder in (data, out):
        folder.mkdir()
    report_of([curve("famc", 1.0), curve("laplacian:operator=tutte", 2.0)]).write(out / "curves.json")
    reproduce(["laplacian"], data, out=out)
    reproduce(["pdct"], data, out=out, again=["laplacian"])
    written = json.loads((out / "reproduction.json").read_text())
    assert list(written["papers"]) == ["laplacian", "pdct"]
    assert [one.codec for one in BenchReport.read(out / "curves.json").curves] == ["famc"]
    reproduce(["pdct"], data, out=out, again=["all"])
    assert BenchReport.read(out / "curves.json").curves == []
    with pytest.raises(InputError, match="no codec 'cobra' to measure again"):
        reproduce(["pdct"], data, out=out, again=["cobra"])
    (out / "reproduction.json").write_text('{"papers": {"pca": [{"id": 3}]}}')
    with pytest.raises(InputError, match="a claim of pca has id of another type"):
        reproduce(["pdct"], data, out=out)


LAPLACIANS = (("tutte", "none"), ("mean-value", "none"), ("mean-value", "rigid"))


def test_wrong_arguments(run: Run, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there are mcgv, pca"):
        reproduce(["famc"], tmp_path)
    assert run("reproduce", "pca", "--data", tmp_path / "none").status == 1


def test_the_hypothetical_predictor_takes_fewer_bits(tmp_path: Path) -> None:
    gvpipe.write(waving(10, 12), tmp_path / "sheet.npz")
    lab = Lab(tmp_path, (40.0, 80.0))
    for point, known in zip(
        hypothetical_points(lab.sequence("sheet"), lab), lab.points("sheet", "pca:predictor=navg"), strict=True
    ):
        assert point["kg"] == pytest.approx(known["kg"], rel=0.2)
        coefficients = known["sections"]["coefficients.0"]
        assert 0 < point["bpvf"] < 8 * (known["bytes"] - 0.1 * coefficients) / (100 * 12)
