"""Sequences that anyone may fetch: where they are, under which licence, and how a download becomes a sequence.

Each lies in a public repository at one commit. Its file is checked against its length and SHA-256 before anything reads it.
What is written is ``NAME.npz``: positions, triangles and rate, all parts as one mesh.
"""

from __future__ import annotations

import hashlib
import http.client
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from gvpipe.container.http_request import Answer
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.atomic import temporary_folder
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress, silent
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback import files

RAW = "https://raw.githubusercontent.com"
FOX = f"{RAW}/bevyengine/bevy/4805ca792c3e94eef07afd6fa9a2712f388c9a67/assets/models/animated/Fox.glb"
SAMPLES = f"{RAW}/DRx3D/glTF-Sample-Assets-OLD/02d48689ce60c8799207f180ae324997e974c956/Models"
KAYKIT = (
    f"{RAW}/KayKit-Game-Assets/KayKit-Character-Pack-Adventures-1.0/672074b73ba276876a19e8816ecdc5241817ab47"
    "/addons/kaykit_character_pack_adventures/Characters/gltf"
)
QUATERNIUS = (
    f"{RAW}/castle-engine/demo-models/6dbdb8fd2bce0d643b10436ef31220f835c9baf7"
    "/animation/gltf_skinned_animation/animals_from_quaternius"
)
DEM_BONES = f"{RAW}/electronicarts/dem-bones/09b899b4158ebb59c0c7a7f58e996eef52be77e3/data"
FOX_SUM = "d97044e701822bac5a62696459b27d7b375aada5de8574ed4362edbba94771f7"
MORPH_SUM = "005f1d9dd938c553a506d6bf3d21830fc3f2ec3a199d9332e9a625baf7342bef"
STAG_SUM = "170b964909d16d1ab4d428b1d714f25016913d32481acd9c3d62923192583be6"
FOX_LICENCE = "model CC0, rig and animation CC-BY 4.0 (PixelMannen, tomkranis, AsoboStudio, scurest)"
MORPH_LICENCE = "CC-BY 4.0 (Analytical Graphics, Ed Mackey)"
PIECE = 1 << 16


@dataclass(frozen=True)
class PublicSequence:
    """A sequence to fetch.

    Args:
        name: of the sequence.
        url: of the file it is made of.
        sha256, bytes: of that file.
        licence: as its source states it, and who made it.
        what: what it tests: vertices, frames, kind of motion.
        clip: of the file's animations; "": its only one.
        fps: frames per second to sample at; 0: as the file has them.
    """

    name: str
    url: str
    sha256: str
    bytes: int
    licence: str
    what: str
    clip: str = ""
    fps: float = 30.0

    def to_json(self) -> dict[str, Any]:
        """All fields as JSON values."""
        return asdict(self)


SEQUENCES = (
    PublicSequence("fox_walk", FOX, FOX_SUM, 162852, FOX_LICENCE, "triangle soup, V 1728, F 23", "Walk"),
    PublicSequence("fox_gallop", FOX, FOX_SUM, 162852, FOX_LICENCE, "triangle soup, V 1728, F 36", "Run"),
    PublicSequence(
        "cesium_man",
        f"{SAMPLES}/CesiumMan/glTF-Binary/CesiumMan.glb",
        "659349b0a374b73d5362a61070039bc8601401bbdeacbece4f3680fb4bfd41b0",
        490956,
        "CC-BY 4.0 with trademark limitations (Cesium)",
        "walking figure, V 3273, F 60",
    ),
    PublicSequence(
        "morph_pulse",
        f"{SAMPLES}/MorphStressTest/glTF-Binary/MorphStressTest.glb",
        MORPH_SUM,
        575900,
        MORPH_LICENCE,
        "morph targets, mostly still, V 1528, F 191",
        "Pulse",
    ),
    PublicSequence(
        "morph_globe",
        f"{SAMPLES}/AnimatedMorphSphere/glTF-Binary/AnimatedMorphSphere.glb",
        "eda89538fdada0ff1edd813428c8728d351d6b136ebfcbc664abb9cf3431c213",
        221004,
        "CC0 (Microsoft)",
        "morph targets, V 1876, F 217",
    ),
    PublicSequence(
        "knight_spin",
        f"{KAYKIT}/Knight.glb",
        "60428e3abc09ba83e595d256e3af8c5c976b46cdae599f0802fc82b4a3445168",
        3659532,
        "CC0 (Kay Lousberg)",
        "game character of many parts, V 7024, F 73",
        "2H_Melee_Attack_Spin",
    ),
    PublicSequence(
        "mage_walk",
        f"{KAYKIT}/Mage.glb",
        "cf898585da33fab50c724d31605fb931eb2912e6d2280092141e98ca81ad507d",
        3589240,
        "CC0 (Kay Lousberg)",
        "game character of many parts, V 5279, F 33",
        "Walking_A",
    ),
    PublicSequence(
        "bunny_wave",
        f"{QUATERNIUS}/Bunny.gltf",
        "36f3c737887af8f1c3fb3a27021c81db8f532916921f8b54e51b2c62fe009129",
        1427684,
        "CC0 (Quaternius)",
        "skinned figure, V 4545, F 51",
        "Wave",
    ),
    PublicSequence(
        "stag_gallop",
        f"{QUATERNIUS}/Stag.gltf",
        STAG_SUM,
        3224724,
        "CC0 (Quaternius)",
        "skinned animal, fast, V 7438, F 17",
        "Gallop",
    ),
    PublicSequence(
        "stag_eating",
        f"{QUATERNIUS}/Stag.gltf",
        STAG_SUM,
        3224724,
        "CC0 (Quaternius)",
        "skinned animal, slow and long, V 7438, F 364",
        "Eating",
    ),
    PublicSequence(
        "bone_anim",
        f"{DEM_BONES}/Bone_Anim.abc",
        "9a41b615ca2196bb0c61980b86ba3fd0ea55ce859a6fa0c4f61b4aedc1dd0bd9",
        3716051,
        "BSD-3 (Electronic Arts, Dem Bones)",
        "small and long, V 754, F 400; Alembic (pip install 'gvpipe[alembic]')",
        fps=0.0,
    ),
)


def public_sequences(names: Sequence[str]) -> list[PublicSequence]:
    """Return the sequences of these names; raises `InputError` for one that is not in the table."""
    known = {sequence.name: sequence for sequence in SEQUENCES}
    for name in names:
        if name not in known:
            raise InputError(f"no sequence {name!r}; there are {', '.join(known)}{did_you_mean(name, list(known))}")
    return [known[name] for name in names]


def fetch_sequence(
    sequence: PublicSequence, folder: str | os.PathLike[str], progress: Progress | None = None
) -> tuple[Path, bool]:
    """Fetch a sequence into ``folder/NAME.npz``; return the path, and whether it was fetched or was there already.

    The file is written as a whole or not at all.

    Raises:
        InputError: there is no answer, the download is not the file of the table, or it cannot be read.
        OutputError: the folder cannot be written.
    """
    target = Path(folder) / f"{sequence.name}.npz"
    if target.is_file():
        return target, False
    with temporary_folder() as temporary:
        download = Path(temporary) / sequence.url.rpartition("/")[2]
        download.write_bytes(_download(sequence, progress or silent))
        made = files.read(str(download), sequence.fps or None, sequence.clip or None)
        plain = MeshSequence(made.read(0, made.n_frames), made.faces, made.fps, name=sequence.name)
        target.parent.mkdir(parents=True, exist_ok=True)
        files.write(plain, str(target))
    return target, True


def _download(sequence: PublicSequence, progress: Progress) -> bytes:
    """The bytes at a sequence's address, which are those of the table; raises `InputError`."""
    data = bytearray()
    try:
        with Answer(sequence.url, {"Accept-Encoding": "identity", "User-Agent": "gvpipe"}, sequence.bytes) as answer:
            while len(data) <= sequence.bytes:  # one piece more than the table says, at most
                piece = answer.read(PIECE)
                if not piece:
                    break
                data += piece
                progress(sequence.name, min(1.0, len(data) / sequence.bytes))
    except (OSError, http.client.HTTPException, ValueError) as exc:
        raise InputError(f"{sequence.url} cannot be fetched: {exc}; check the connection and try again") from exc
    if len(data) != sequence.bytes:
        raise InputError(f"{sequence.url} gave {len(data)} bytes, {sequence.bytes} are expected; try again, or report it")
    found = hashlib.sha256(data).hexdigest()
    if found != sequence.sha256:
        raise InputError(f"{sequence.url} has SHA-256 {found}, {sequence.sha256} is expected; nothing was written")
    return bytes(data)
