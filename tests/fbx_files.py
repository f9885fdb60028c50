"""A small FBX file in text, made by hand, with pictures and geometry caches, for the tests of its reader."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

SECOND = 46186158000  # ticks of FBX
FBX = f"""; FBX 7.4.0 project file
FBXHeaderExtension:  {{
	FBXHeaderVersion: 1003
	FBXVersion: 7400
}}
GlobalSettings:  {{
	Version: 1000
	Properties70:  {{
		P: "UpAxis", "int", "Integer", "",1
		P: "UpAxisSign", "int", "Integer", "",1
		P: "FrontAxis", "int", "Integer", "",2
		P: "FrontAxisSign", "int", "Integer", "",1
		P: "CoordAxis", "int", "Integer", "",0
		P: "CoordAxisSign", "int", "Integer", "",1
		P: "UnitScaleFactor", "double", "Number", "",1
		P: "TimeMode", "enum", "", "",11
	}}
}}
Objects:  {{
	Geometry: 1, "Geometry::quad", "Mesh" {{
		Vertices: *12 {{
			a: 0,0,0,1,0,0,1,1,0,0,1,0
		}}
		PolygonVertexIndex: *4 {{
			a: 0,1,2,-4
		}}
		GeometryVersion: 124
	}}
	Model: 2, "Model::box", "Mesh" {{
		Version: 232
	}}
	AnimationStack: 3, "AnimStack::Lift", "" {{
		Properties70:  {{
			P: "LocalStart", "KTime", "Time", "",0
			P: "LocalStop", "KTime", "Time", "",{SECOND}
		}}
	}}
	AnimationLayer: 4, "AnimLayer::base", "" {{
	}}
	AnimationCurveNode: 5, "AnimCurveNode::T", "" {{
	}}
	AnimationCurve: 6, "AnimCurve::", "" {{
		KeyVer: 4008
		KeyTime: *2 {{
			a: 0,{SECOND}
		}}
		KeyValueFloat: *2 {{
			a: 0,24
		}}
		KeyAttrFlags: *1 {{
			a: 4
		}}
		KeyAttrDataFloat: *4 {{
			a: 0,0,0,0
		}}
		KeyAttrRefCount: *1 {{
			a: 2
		}}
	}}
}}
Connections:  {{
	C: "OO",1,2
	C: "OO",2,0
	C: "OO",4,3
	C: "OO",5,4
	C: "OP",5,2, "Lcl Translation"
	C: "OP",6,5, "d|Y"
}}
"""
TEXTURE = """
	Material: 20, "Material::paint", "" {{
		ShadingModel: "phong"
	}}
	Texture: 21, "Texture::picture", "" {{
		Type: "TextureVideoClip"
		FileName: "{name}"
		RelativeFilename: "{name}"
	}}
"""
CACHE = """
	Deformer: 30, "Deformer::cached", "VertexCacheDeformer" {{
		Channel: "{channel}"
		Properties70:  {{
			P: "Active", "bool", "", "",1
			P: "Channel", "KString", "", "", "{channel}"
		}}
	}}
	Cache: 31, "Cache::file", "" {{
		Properties70:  {{
			P: "CacheFileName", "KString", "XRefUrl", "", "{name}"
			P: "CacheAbsoluteFileName", "KString", "XRefUrl", "", "{name}"
			P: "CacheFileType", "enum", "", "",{kind}
		}}
	}}
"""
MC_HEAD = """<?xml version="1.0"?>
<Autodesk_Cache_File>
  <cacheType Type="OneFile" Format="mcc"/>
  <time Range="0-6000"/>
  <cacheTimePerFrame TimePerFrame="250"/>
  <cacheVersion Version="2.0"/>
  <Channels>
    <channel0 ChannelName="quad" ChannelType="FloatVectorArray" ChannelInterpretation="positions" SamplingType="Regular"
      SamplingRate="250" StartTime="0" EndTime="{last}"/>
  </Channels>
</Autodesk_Cache_File>
"""


def with_objects(objects: str, *connections: str) -> str:
    """The file with more objects, and what connects them."""
    whole = FBX.replace("\tAnimationStack: 3", objects + "\tAnimationStack: 3")
    return whole.replace('\tC: "OO",1,2\n', '\tC: "OO",1,2\n' + "".join(f"\tC: {each}\n" for each in connections))


def with_texture(name: str) -> str:
    """The file with a material that shows a picture."""
    return with_objects(TEXTURE.format(name=name), '"OO",20,2', '"OP",21,20, "DiffuseColor"')


def with_cache(name: str, kind: int = 1, channel: str = "") -> str:
    """The file with a geometry cache: PC2 is of kind 1, Maya's of kind 2."""
    return with_objects(CACHE.format(name=name, kind=kind, channel=channel), '"OO",30,1', '"OO",31,30')


def write_mc(path: Path, frames: Any) -> None:
    """Write positions ``(F, V, 3)`` as Maya's cache in one file of 32 bits, a sample in each 24th of a second."""
    path.with_suffix(".xml").write_text(MC_HEAD.format(last=250 * (len(frames) - 1)))
    last = 250 * (len(frames) - 1)
    head = _chunk(
        "CACH", _chunk("VRSN", b"0.1\0") + _chunk("STIM", struct.pack(">i", 0)) + _chunk("ETIM", struct.pack(">i", last))
    )
    blocks = []
    for frame, points in enumerate(np.asarray(frames, ">f4")):
        size = _chunk("SIZE", struct.pack(">i", len(points)))
        time = _chunk("TIME", struct.pack(">i", 250 * frame))
        blocks.append(_chunk("MYCH", time + _chunk("CHNM", b"quad\0") + size + _chunk("FVCA", points.tobytes())))
    path.write_bytes(head + b"".join(blocks))


def _chunk(tag: str, data: bytes) -> bytes:
    """A chunk of an IFF file: ``FOR4`` groups have their kind before what they hold."""
    padded = data + bytes(-len(data) % 4)
    if tag in ("CACH", "MYCH"):
        return b"FOR4" + struct.pack(">I", len(padded) + 4) + tag.encode() + padded
    return tag.encode() + struct.pack(">I", len(data)) + padded
