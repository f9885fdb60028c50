"""A small FBX file in text, made by hand, for the tests of its reader."""

from __future__ import annotations

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
