"""What is published of the baselines' own rates and errors, as far as a text with the number is at hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gvpipe.benchmark.bd_rate import rate_at
from gvpipe.benchmark.reproduction.claims import ABOUT, AT_LEAST, AT_MOST, Claim, less_error, less_rate_overall
from gvpipe.benchmark.reproduction.lab import Lab
from gvpipe.benchmark.reproduction.pdct_claims import less_error_than_tls

KG = "kg"
FINE = 90.0  # a quality whose error is below those of the papers' tables
NO_NUMBER = {
    "afxic": "the paper is not at hand; FAMC's abstract and Figures 7 and 8 of the mcgv paper compare with it",
    "awc": "the abstract has no number; Figure 9 of the pdct paper compares with it",
    "coddyac": "no text with a number of Coddyac alone is at hand; the pca paper's abstract compares with such methods",
    "gv": "the paper is not at hand; Figure 9 of the mcgv paper compares with it",
    "kglpc": "the paper is not at hand; Figure 9 of the pdct paper compares with it",
    "maverg": "the paper is not at hand; Figure 8 of the pdct paper compares with it",
    "pcaanim": "the paper is not at hand; Figure 10 of the mcgv paper and Figure 9 of the pdct paper compare with it",
    "rt": "the abstract has no number; Figures 8 and 10 of the mcgv paper compare with it",
}


def claims() -> list[Claim]:
    """The figures, by baseline."""
    none = [Claim(f"baselines-{name}", f"`{name}`", "its own figures", None, "", note=why) for name, why in NO_NUMBER.items()]
    return [*_dynapack(), *_d3dmc(), *_famc(), *_cpca(), *_rlpca(), _tls(), *none]


def _dynapack() -> list[Claim]:
    made = []
    for predictor, most in (("elp", 2.91), ("space", 7.19), ("time", 6.91)):
        text = f"at most {most} bits per coordinate at 13 bits with {predictor}, on the paper's animations"
        measure = _bits_per_coordinate("chicken", f"dynapack:bits=13:predictor={predictor}")
        note = "on chicken, of whole files; the paper's animations are not at hand"
        key = f"baselines-dynapack-{predictor}"
        made.append(Claim(key, "`dynapack`, abstract", text, most, "bits", AT_MOST, measure, note))
    return made


def _d3dmc() -> list[Claim]:
    where = "`d3dmc`, mcgv paper"
    humanoid = "70 % less error than AFX-IC at 2.2 bpvf, on humanoid"
    note = "on samba in place of humanoid; from the 80 and 94 % of Figure 7"
    measure = less_error("samba", "d3dmc", "afxic", "rmse", 2.2)
    made = [Claim("baselines-d3dmc-f7", f"{where}, Figure 7", humanoid, 70, "% of error", ABOUT, measure, note)]
    for other, title in (("afxic", "AFX-IC"), ("rt", "RT")):
        text = f"less error than {title} at 2.2 bpvf, on chicken"
        measure = less_error("chicken", "d3dmc", other, "rmse", 2.2)
        made.append(Claim(f"baselines-d3dmc-{other}", f"{where}, Figure 8", text, 0, "% of error", AT_LEAST, measure))
    return made


def _famc() -> list[Claim]:
    made = []
    for name in ("chicken", "cow"):
        text = f"60 % fewer bits than MPEG-4's technique before it (AFX-IC), on {name}"
        measure = less_rate_overall(name, "famc", "afxic", KG)
        note = "averaged over the curve; the abstract names no sequence"
        made.append(Claim(f"baselines-famc-{name}", "`famc`, abstract", text, 60, "% of rate", ABOUT, measure, note))
    for name, bpvf, kg in (("chicken", 1.55, 0.09), ("cow", 2.33, 0.31)):
        text = f"competes with NAVG, which takes {bpvf} bpvf at KG {kg} on {name}"
        where = "`famc`, pca paper, Figures 6 and 9, Table 1"
        note = "how near FAMC comes stands in pictures alone"
        made.append(Claim(f"baselines-famc-navg-{name}", where, text, bpvf, "bpvf", ABOUT, _fine_rate(name, "famc", kg), note))
    return made


def _cpca() -> list[Claim]:
    made = []
    for other, title in (("pcaanim", "PCA"), ("kglpc", "PCA with linear prediction")):
        text = f"fewer bits than {title}, on chicken"
        measure = less_rate_overall("chicken", "cpca", other, "da")
        note = "averaged over the curve; the abstract has no number"
        made.append(Claim(f"baselines-cpca-{other}", "`cpca`, abstract", text, 0, "% of rate", AT_LEAST, measure, note))
    return made


def _rlpca() -> list[Claim]:
    made = []
    for other, title in (("pdct:clusters=40", "PDCT"), ("cpca", "CPCA"), ("pcaanim", "PCA"), ("kglpc", "KG")):
        text = f"fewer bits than {title}, on chicken"
        measure = less_rate_overall("chicken", "rlpca", other, "da")
        key, note = f"baselines-rlpca-{other.split(':')[0]}", "averaged over the curve; the text has no number"
        made.append(Claim(key, "`rlpca`, pdct paper, Figure 9", text, 0, "% of rate", AT_LEAST, measure, note))
    return made


def _tls() -> Claim:
    text = "PDCT has 95 % less error at one rate, on chicken"
    return replace(less_error_than_tls(), id="baselines-tls-pdct", where="`tls`, pdct paper, Figure 8", text=text)


def _bits_per_coordinate(sequence: str, codec: str) -> Callable[[Lab], float | None]:
    return lambda lab: float(lab.point(sequence, codec, 75.0)["bpvf"]) / 3


def _fine_rate(sequence: str, codec: str, level: float) -> Callable[[Lab], float | None]:
    """Rate at an error that coarse qualities do not reach: one more is measured."""

    def measured(lab: Lab) -> float | None:
        lab.point(sequence, codec, FINE)
        return rate_at(lab.points(sequence, codec), KG, level)

    return measured
