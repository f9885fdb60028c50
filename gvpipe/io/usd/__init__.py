"""USD scenes (.usda, .usdc, .usd, .usdz) by Pixar's own library, package usd-core: reading and writing.

Source: Pixar, Universal Scene Description 26.11: UsdGeom, UsdSkel, UsdShade (UsdPreviewSurface specification).
"""
