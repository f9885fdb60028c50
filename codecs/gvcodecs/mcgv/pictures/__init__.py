"""The pictures: residuals or trajectory coefficients as planes of a video."""
